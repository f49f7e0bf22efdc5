// `camgyro simulate SCENARIO.yaml --out DIR`.
#ifndef CAMGYRO_TOOLS_SIMULATE_COMMAND_H_
#define CAMGYRO_TOOLS_SIMULATE_COMMAND_H_

#include <string>
#include <vector>

#include "core/result.h"

namespace camgyro {

// Makes the recording of a scenario file in `out_dir` (docs/simulate.md) and prints what it made.
// `overrides` are "section.key=value" and win over the file.
Status RunSimulate(const std::string& scenario_path, const std::string& out_dir,
                   const std::vector<std::string>& overrides = {});

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_SIMULATE_COMMAND_H_
