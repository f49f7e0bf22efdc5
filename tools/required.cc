#include "tools/required.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "core/state.h"

DEFINE_string(
    require, "",
    "parameters that have to be determined, else exit code 4 (results are written all the "
    "same), separated by commas: focal, principal, readout, delay, bias, mounting, or "
    "names as in calibration.yaml's unobservable");

namespace camgyro {
namespace {

// Parameters by their name, or by the first words of it in files, in the library or for people.
std::vector<int> ParametersNamed(const std::string& name) {
  std::vector<int> found;
  for (int i = 0; i < kStateSize; ++i) {
    const StateParameter& parameter = StateTable()[static_cast<size_t>(i)];
    for (const std::string known : {parameter.name, parameter.long_name, parameter.label}) {
      const bool begins = known.rfind(name, 0) == 0;
      if (begins && (known.size() == name.size() ||
                     std::string("_ ,").find(known[name.size()]) != std::string::npos)) {
        found.push_back(i);
        break;
      }
    }
  }
  return found;
}

std::vector<std::string> RequiredNames() {
  std::vector<std::string> names;
  std::istringstream list(FLAGS_require);
  for (std::string name; std::getline(list, name, ',');) {
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

}  // namespace

Status CheckRequireFlag() {
  for (const std::string& name : RequiredNames()) {
    if (ParametersNamed(name).empty()) {
      return BadUsage("--require=" + FLAGS_require + ": `" + name +
                      "` is none of focal, principal, readout, delay, bias, mounting");
    }
  }
  return {};
}

Status CheckDetermined(const Calibration& calibration) {
  const auto& determined = calibration.determined;
  if (std::none_of(determined.begin(), determined.end(), [](bool d) { return d; })) {
    return CannotEstimate(
        "none of the parameters is determined: the recording needs more rotation, about all three "
        "axes, or more texture, or, if a doubt says so, has something that the model lacks");
  }
  std::string open;
  for (const std::string& name : RequiredNames()) {
    for (const int i : ParametersNamed(name)) {
      if (determined[static_cast<size_t>(i)]) continue;
      open += (open.empty() ? "" : ", ") + StateNames()[static_cast<size_t>(i)];
    }
  }
  if (!open.empty()) return CannotEstimate("required, but not determined: " + open);
  return {};
}

}  // namespace camgyro
