// What `camgyro compare` compares estimators on: recordings with known truth, or scenarios that are
// simulated anew for every seed.
#ifndef CAMGYRO_TOOLS_COMPARISON_COMPARISON_INPUT_H_
#define CAMGYRO_TOOLS_COMPARISON_COMPARISON_INPUT_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "simulation/scenario.h"

namespace camgyro::comparison {

// Where estimators begin, and the prior that they all get.
enum class StartKind {
  // The truth, moved by a draw from the standard deviations of Jia & Evans section V.C, which are
  // then the prior: over many seeds the prior is right.
  kDrawn,
  // The initial values of section V.C and what the recording declares (sensor.yaml), with the same
  // deviations.
  kDeclared,
  // What the program's own search finds in the whole recording, with MakePrior's deviations.
  kFound,
};

struct Case {
  std::string name;                              // of the report and of files
  std::optional<simulation::Scenario> scenario;  // absent: a recording
  std::string recording;                         // its folder
  std::string truth_file;
};

// A word of the command line: a folder is a recording; a .yaml file is a scenario; else the name
// of a motion (walking, running, ...), which is the scenario of that motion. `overrides`:
// "section.key=value", for scenarios. truth_file: of a recording; empty: its truth.yaml. Errors:
// kBadUsage for a word that is none of them; kBadInput if there is no truth, and as LoadScenario.
Result<Case> ResolveCase(const std::string& word, const std::vector<std::string>& overrides,
                         const std::string& truth_file);

// One run's data.
struct Input {
  Recording recording;
  Calibration truth;
  Calibration start;  // values to begin with
  Prior prior;
  // Scenarios only: the noise of the tracks, and the matches without noise, outliers and moving
  // points, one entry per pair of neighbouring frames.
  double noise_px = 0.0;
  std::vector<FramePair> exact_matches;
};

// run: number of the seed, 0 for the scenario's own; it also draws the start. Aspect ratio and
// distortion are the truth's: no estimator looks for them. Errors: kBadInput if the recording has
// no image motion, is not of the truth's resolution, its gyro does not cover half of its frames, or
// it lacks what the start needs.
Result<Input> MakeInput(const Case& from, uint64_t run, StartKind start);

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_COMPARISON_INPUT_H_
