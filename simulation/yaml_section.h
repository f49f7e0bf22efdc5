// Reads a mapping of a YAML file into variables, and refuses what it does not know.
#ifndef CAMGYRO_SIMULATION_YAML_SECTION_H_
#define CAMGYRO_SIMULATION_YAML_SECTION_H_

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

// One mapping. Read() every key that exists, then Finish(). The first complaint of a file is kept,
// as "line 7: camera.focal: unknown key; did you mean focal_px?".
class YamlSection {
 public:
  // `complaint` outlives the section and is shared by all sections of a file.
  YamlSection(const YAML::Node& node, std::string name, std::string* complaint);

  YamlSection Child(const std::string& key);

  // Leaves *value as it is if the key is absent. True if it was there.
  template <typename T>
  bool Read(const std::string& key, T* value, Range range = Range::kAny) {
    const YAML::Node node = Take(key);
    if (!node.IsDefined()) return false;
    try {
      *value = node.as<T>();
    } catch (const YAML::Exception&) {
      Complain(node, key, "has the wrong type");
      return false;
    }
    if constexpr (std::is_same_v<T, double>) Check(node, key, *value, range);
    return true;
  }

  template <int kRows>
  bool Read(const std::string& key, Eigen::Matrix<double, kRows, 1>* value,
            Range range = Range::kAny) {
    const YAML::Node node = Take(key);
    if (!node.IsDefined()) return false;
    std::vector<double> numbers;
    try {
      numbers = node.as<std::vector<double>>();
    } catch (const YAML::Exception&) {
    }
    if (numbers.size() != static_cast<size_t>(kRows)) {
      Complain(node, key, "must be a list of " + std::to_string(kRows) + " numbers");
      return false;
    }
    for (int i = 0; i < kRows; ++i) {
      (*value)[i] = numbers[static_cast<size_t>(i)];
      Check(node, key, (*value)[i], range);
    }
    return true;
  }

  // One of several words.
  template <typename Enum>
  bool Read(const std::string& key, Enum* value,
            const std::vector<std::pair<std::string, Enum>>& words) {
    std::string word;
    if (!Read(key, &word)) return false;
    std::vector<std::string> names;
    for (const auto& [name, meaning] : words) {
      if (name == word) {
        *value = meaning;
        return true;
      }
      names.push_back(name);
    }
    Complain(node_[key], key, "is \"" + word + "\"" + Suggestion(word, names));
    return false;
  }

  void Finish();

  void Complain(const YAML::Node& where, const std::string& key, const std::string& what);

 private:
  YAML::Node Take(const std::string& key);
  void Check(const YAML::Node& node, const std::string& key, double value, Range range);
  static std::string Suggestion(const std::string& word, const std::vector<std::string>& known);

  const YAML::Node node_;
  std::string name_;  // "camera." or empty for the whole file
  std::string* complaint_;
  std::vector<std::string> known_;
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_YAML_SECTION_H_
