#include "tools/simulate_command.h"

#include <gflags/gflags.h>

#include <cstdio>

#include "simulation/simulate.h"
#include "simulation/write_recording.h"
#include "tools/commands.h"

DECLARE_string(out);

namespace camgyro {

using simulation::Scenario;
using simulation::Simulated;
using simulation::VideoFormat;

Status RunSimulate(const std::string& scenario_path, const std::string& out_dir,
                   const std::vector<std::string>& overrides) {
  const Result<Scenario> scenario = simulation::LoadScenario(scenario_path, overrides);
  if (!scenario) return tl::unexpected(scenario.error());
  const bool video = scenario->video.format != VideoFormat::kNone;
  const Result<Simulated> simulated = simulation::SimulateSensors(*scenario);  // tracks: as written
  if (!simulated) {
    Error error = simulated.error();
    error.message = scenario_path + ": " + error.message;
    return tl::unexpected(error);
  }
  const auto progress = [](size_t done, size_t all) {
    if (done % 30 == 0 || done == all)
      std::fprintf(stderr, "\rrendered %zu of %zu frames", done, all);
    if (done == all) std::fprintf(stderr, "\n");
  };
  Status status = simulation::WriteRecording(*simulated, *scenario, out_dir, progress);
  if (!status) return status;
  std::string effects;
  for (const std::string& name : simulation::ActiveEffects(scenario->effects)) {
    effects += (effects.empty() ? "" : ", ") + name;
  }
  std::printf("%s: %zu frames%s, %zu gyro samples, effects: %s\n", out_dir.c_str(),
              simulated->recording.frames.size(), video ? " rendered" : "",
              simulated->recording.gyro.size(), effects.empty() ? "none" : effects.c_str());
  return {};
}

Command SimulateCommand() {
  Command command;
  command.name = "simulate";
  command.arguments = "SCENARIO.yaml [KEY=VALUE...]";
  command.summary =
      "makes a recording from a scenario file: tracks or a rendered video, with the truth beside "
      "it "
      "(KEY=VALUE: section.key of the scenario)";
  command.flags = {"out"};
  command.run = [](const std::vector<std::string>& arguments) -> Status {
    if (FLAGS_out.empty()) return BadUsage("simulate: --out=DIR is needed");
    return RunSimulate(arguments[0], FLAGS_out, {arguments.begin() + 1, arguments.end()});
  };
  return command;
}

}  // namespace camgyro
