#include "tools/comparison/comparison_input.h"

#include <algorithm>
#include <filesystem>
#include <random>
#include <utility>

#include "core/nearest_name.h"
#include "core/time.h"
#include "estimator/calibrate.h"
#include "estimator/reference/implicit_ekf.h"
#include "frontend/readers/read_recording.h"
#include "frontend/track_jumps.h"
#include "pipeline/read_calibration.h"
#include "pipeline/run.h"
#include "simulation/simulate.h"

namespace camgyro::comparison {
namespace {

namespace fs = std::filesystem;

using simulation::Simulated;

const std::vector<std::string>& MotionNames() {
  static const std::vector<std::string> names = {"handheld", "walking",     "running", "panning",
                                                 "rotation", "single_axis", "slow"};
  return names;
}

std::string NameOf(const fs::path& path) {
  const fs::path name = path.filename().empty() ? path.parent_path().filename() : path.filename();
  return name.extension() == ".yaml" ? name.stem().string() : name.string();
}

Prior DrawStart(const Calibration& truth, uint64_t seed) {
  const StateVector sigma = PaperStart(truth).sigma;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  StateVector d;
  for (int i = 0; i < kStateSize; ++i) d[i] = sigma[i] * normal(random);
  return {Moved(truth, d), sigma};
}

Result<Prior> DeclaredStart(const Recording& recording, const Calibration& truth) {
  const CameraGuess& declared = recording.camera;
  if (!declared.focal_px || !declared.q_gyro_cam) {
    return BadInput(recording.path + ": --start=declared needs a focal length and a mounting, " +
                    "`intrinsics` and `T_BS` of cam0/sensor.yaml");
  }
  Calibration guess = truth;
  guess.lens[kFocal] = *declared.focal_px;
  guess.q_gyro_cam = *declared.q_gyro_cam;
  Prior prior = PaperStart(guess);
  Calibration& start = prior.mean;
  if (declared.principal_px) start.lens.segment<2>(kCx) = *declared.principal_px;
  if (declared.readout_s) start.readout_s = *declared.readout_s;
  if (declared.delay_s) start.delay_s = *declared.delay_s;
  return prior;
}

Status FindStartOf(Input* input) {
  const Recording& recording = input->recording;
  const Result<StartResult> found =
      FindStartAndFocal(recording, RotationsFrom(recording), StartOptions(), FocalScanOptions());
  if (!found) return tl::unexpected(found.error());
  input->prior = MakePrior(recording, *found);
  input->start = input->prior.mean;
  input->start.bias_gyro_rad_s = found->bias_gyro_rad_s;
  if (found->focal && found->focal->determined) {
    input->start.lens[kFocal] = found->focal->value_px;
  }
  return {};
}

// Frames whose stamps, on the gyro's clock, lie inside the gyro's samples.
double CoveredFrames(const Recording& recording, double delay_s) {
  const int64_t delay_ns = StampAt(0, delay_s);
  const auto inside =
      std::count_if(recording.frames.begin(), recording.frames.end(), [&](const Frame& frame) {
        return frame.stamp_ns + delay_ns >= recording.gyro.front().stamp_ns &&
               frame.stamp_ns + delay_ns <= recording.gyro.back().stamp_ns;
      });
  return static_cast<double>(inside) / static_cast<double>(recording.frames.size());
}

Status ReadInput(const Case& from, Input* input) {
  Result<Calibration> truth = ReadCalibration(from.truth_file);
  if (!truth) return tl::unexpected(truth.error());
  input->truth = *truth;
  Result<Recording> recording = ReadRecording(from.recording);
  if (!recording) return tl::unexpected(recording.error());
  input->recording = std::move(*recording);
  const CameraGuess& camera = input->recording.camera;
  if (input->recording.tracks.empty() && input->recording.matches.empty()) {
    return BadInput(from.recording + ": no tracks and no matches; `camgyro track` makes them");
  }
  if (camera.width_px != truth->width_px || camera.height_px != truth->height_px) {
    return BadInput(from.truth_file + ": for pictures of " + std::to_string(truth->width_px) +
                    " x " + std::to_string(truth->height_px) + ", but those of " + from.recording +
                    " are " + std::to_string(camera.width_px) + " x " +
                    std::to_string(camera.height_px));
  }
  return {};
}

Status SimulateInput(const Case& from, uint64_t run, Input* input) {
  Result<Simulated> simulated =
      simulation::SimulateTracks(*from.scenario, from.scenario->seed + run);
  if (!simulated) return BadInput(from.name + ": " + simulated.error().message);
  input->truth = simulated->truth;
  input->noise_px = from.scenario->tracks.noise_px;
  input->recording = std::move(simulated->recording);
  input->recording.path = from.name;
  std::vector<std::vector<TrackedPoint>> exact(input->recording.tracks.size());
  for (size_t f = 0; f < exact.size(); ++f) {
    for (size_t i = 0; i < simulated->points[f].size(); ++i) {
      const simulation::PointTruth& point = simulated->points[f][i];
      if (point.outlier || point.moving) continue;
      exact[f].push_back({input->recording.tracks[f][i].track_id, point.px});
    }
  }
  input->exact_matches = PairsFromTracks(exact, 1);
  return {};
}

}  // namespace

Result<Case> ResolveCase(const std::string& word, const std::vector<std::string>& overrides,
                         const std::string& truth_file) {
  Case result;
  result.name = NameOf(word);
  std::error_code ignored;
  if (fs::is_directory(word, ignored)) {
    result.recording = word;
    result.truth_file = truth_file.empty() ? (fs::path(word) / "truth.yaml").string() : truth_file;
    if (!fs::exists(result.truth_file, ignored)) {
      return BadInput(word + ": no truth: " + result.truth_file +
                      " is not there; --truth names a calibration.yaml to compare with");
    }
    return result;
  }
  const auto& motions = MotionNames();
  const bool is_motion = std::find(motions.begin(), motions.end(), word) != motions.end();
  if (!is_motion && !fs::exists(word, ignored)) {
    const std::string nearest = NearestName(word, motions);
    std::string all;
    for (const std::string& name : motions) all += (all.empty() ? "" : ", ") + name;
    return BadUsage("`" + word + "` is neither a recording, nor a scenario file, nor a motion (" +
                    all + ")" + (nearest.empty() ? "" : "; did you mean " + nearest + "?"));
  }
  Result<simulation::Scenario> scenario =
      is_motion ? simulation::ParseScenario("motion: {kind: " + word + "}", overrides)
                : simulation::LoadScenario(word, overrides);
  if (!scenario) return tl::unexpected(scenario.error());
  scenario->gyro.accelerometer = false;
  result.scenario = *scenario;
  return result;
}

Result<Input> MakeInput(const Case& from, uint64_t run, StartKind start) {
  Input input;
  const Status status = from.scenario ? SimulateInput(from, run, &input) : ReadInput(from, &input);
  if (!status) return tl::unexpected(status.error());
  RemoveTrackJumps(&input.recording);
  CameraGuess& camera = input.recording.camera;
  camera.aspect_ratio = input.truth.lens[kAspect];
  camera.SetDistortion(input.truth.distortion_model, input.truth.lens);
  const double covered = CoveredFrames(input.recording, input.truth.delay_s);
  if (covered < 0.5) {
    return BadInput(input.recording.path + ": with the true delay, the gyro covers only " +
                    std::to_string(static_cast<int>(100.0 * covered)) + " % of the frames");
  }
  if (start == StartKind::kFound) {
    if (Status found = FindStartOf(&input); !found) return tl::unexpected(found.error());
    return input;
  }
  const uint64_t seed = (from.scenario ? from.scenario->seed : 0) + run;
  const Result<Prior> chosen = start == StartKind::kDrawn
                                   ? Result<Prior>(DrawStart(input.truth, seed))
                                   : DeclaredStart(input.recording, input.truth);
  if (!chosen) return tl::unexpected(chosen.error());
  input.prior = *chosen;
  input.start = input.prior.mean;
  return input;
}

}  // namespace camgyro::comparison
