#include "simulation/yaml_section.h"

#include <algorithm>

#include "core/nearest_name.h"

namespace camgyro::simulation {
YamlSection::YamlSection(const YAML::Node& node, std::string name, std::string* complaint)
    : node_(node), name_(std::move(name)), complaint_(complaint) {
  if (node_.IsDefined() && !node_.IsNull() && !node_.IsMap()) {
    Complain(node_, "", "must be a mapping of keys to values");
  }
}

YamlSection YamlSection::Child(const std::string& key) {
  return YamlSection(Take(key), name_ + key + ".", complaint_);
}

YAML::Node YamlSection::Take(const std::string& key) {
  known_.push_back(key);
  if (!node_.IsDefined() || !node_.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
  return node_[key];
}

void YamlSection::Check(const YAML::Node& node, const std::string& key, double value, Range range) {
  if (!std::isfinite(value)) Complain(node, key, "must be a finite number");
  if (range == Range::kPositive && !(value > 0.0)) Complain(node, key, "must be positive");
  if (range == Range::kNotNegative && !(value >= 0.0)) {
    Complain(node, key, "must not be negative");
  }
  if (range == Range::kFraction && !(value >= 0.0 && value <= 1.0)) {
    Complain(node, key, "must lie between 0 and 1");
  }
}

std::string YamlSection::Suggestion(const std::string& word,
                                    const std::vector<std::string>& known) {
  const auto nearest =
      std::min_element(known.begin(), known.end(), [&](const std::string& a, const std::string& b) {
        return EditDistance(word, a) < EditDistance(word, b);
      });
  if (nearest == known.end()) return "";
  if (EditDistance(word, *nearest) <= nearest->size() / 2) {
    return "; did you mean " + *nearest + "?";
  }
  std::string all;
  for (const std::string& name : known) all += (all.empty() ? "" : ", ") + name;
  return "; known are " + all;
}

void YamlSection::Finish() {
  if (!node_.IsDefined() || !node_.IsMap()) return;
  for (const auto& entry : node_) {
    const auto key = entry.first.as<std::string>("");
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    Complain(entry.first, key, "unknown key" + Suggestion(key, known_));
  }
}

void YamlSection::Complain(const YAML::Node& where, const std::string& key,
                           const std::string& what) {
  if (!complaint_->empty()) return;
  const YAML::Mark mark = where.Mark();
  if (!mark.is_null()) *complaint_ = "line " + std::to_string(mark.line + 1) + ": ";
  std::string name = name_ + key;
  if (!name.empty() && name.back() == '.') name.pop_back();
  *complaint_ += (name.empty() ? "the scenario" : name) + ": " + what;
}

}  // namespace camgyro::simulation
