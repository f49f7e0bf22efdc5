// Typed look-ups in a YAML file.
#ifndef CAMGYRO_FRONTEND_READERS_YAML_KEYS_H_
#define CAMGYRO_FRONTEND_READERS_YAML_KEYS_H_

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.h"
#include "frontend/readers/text.h"

namespace camgyro {

// The keys of one map of a file. The first error sticks, as in CsvReader.
class YamlKeys {
 public:
  YamlKeys(std::string file, const YAML::Node& root) : file_(std::move(file)), root_(root) {}

  const Status& status() const { return status_; }

  void Fail(const std::string& key, const std::string& message) {
    if (!status_) return;
    const YAML::Node node = root_[key];
    const std::string line = node && node.Mark().line >= 0 ? Concat(":", node.Mark().line + 1) : "";
    status_ = BadInput(Concat(file_, line, ": ", key, ": ", message));
  }

  std::optional<std::string> Text(const std::string& key) {
    const YAML::Node node = root_[key];
    if (!node || node.IsNull()) return std::nullopt;
    if (!node.IsScalar()) {
      Fail(key, "expected a word");
      return std::nullopt;
    }
    return node.Scalar();
  }

  std::optional<double> Number(const std::string& key) {
    const YAML::Node node = root_[key];
    if (!node || node.IsNull()) return std::nullopt;
    double value = 0.0;
    if (!node.IsScalar() || !ParseNumber(std::string_view(node.Scalar()), &value) ||
        !std::isfinite(value)) {
      Fail(key, Concat("'", node.IsScalar() ? node.Scalar() : "a list or map",
                       "' was found, expected a finite number"));
      return std::nullopt;
    }
    return value;
  }

  std::optional<double> PositiveNumber(const std::string& key) {
    const std::optional<double> value = Number(key);
    if (value && *value <= 0.0) Fail(key, Concat(*value, " was found, expected more than zero"));
    return value;
  }

  // The words of a list; empty without the key.
  std::vector<std::string> Texts(const std::string& key, const std::string& expected) {
    const YAML::Node node = root_[key];
    std::vector<std::string> texts;
    if (!node || node.IsNull()) return texts;
    for (size_t i = 0; node.IsSequence() && i < node.size() && node[i].IsScalar(); ++i) {
      texts.push_back(node[i].Scalar());
    }
    if (!node.IsSequence() || texts.size() != node.size()) Fail(key, "expected " + expected);
    return texts;
  }

  // Fails for a key that is none of these: a misspelt one is not to be passed over in silence.
  void AllowOnly(const std::vector<std::string>& allowed) {
    std::string list;
    for (const std::string& key : allowed) list += (list.empty() ? "" : ", ") + key;
    for (const auto& entry : root_) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "a list or map";
      if (std::count(allowed.begin(), allowed.end(), key) > 0) continue;
      const std::string line = Concat(":", entry.first.Mark().line + 1);
      if (status_) {
        status_ = BadInput(Concat(file_, line, ": unknown key `", key, "`, expected ", list));
      }
    }
  }

  // The numbers of a list, or of the `data` of a matrix.
  std::optional<std::vector<double>> Numbers(const std::string& key, const std::string& expected) {
    YAML::Node node = root_[key];
    if (!node || node.IsNull()) return std::nullopt;
    if (node.IsMap()) node.reset(node["data"]);
    std::vector<double> values;
    bool good = node && node.IsSequence();
    for (size_t i = 0; good && i < node.size(); ++i) {
      double value = 0.0;
      good = node[i].IsScalar() && ParseNumber(std::string_view(node[i].Scalar()), &value) &&
             std::isfinite(value);
      values.push_back(value);
    }
    if (good) return values;
    Fail(key, "expected " + expected);
    return std::nullopt;
  }

 private:
  std::string file_;
  const YAML::Node root_;
  Status status_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_YAML_KEYS_H_
