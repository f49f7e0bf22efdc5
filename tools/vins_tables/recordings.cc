#include "core/time.h"
#include "frontend/readers/read_recording.h"
#include "frontend/two_view_rotation.h"
#include "pipeline/read_calibration.h"
#include "tools/vins_tables/vins_tables.h"

namespace camgyro {
namespace {

// The reference of a recording without known motion: 2 s of window, 10 s of propagation, margins.
constexpr double kReferenceSpanS = 16.0;
constexpr double kReferenceStepS = 2.0;

}  // namespace

Result<RecordingWithTruth> SimulateWithTruth(const std::string& name,
                                             const std::vector<std::string>& overrides) {
  const auto scenario = simulation::ParseScenario("", overrides);
  if (!scenario) return tl::unexpected(scenario.error());
  auto simulated = simulation::SimulateTracks(*scenario);
  if (!simulated) return tl::unexpected(simulated.error());
  RecordingWithTruth result;
  result.name = name;
  result.truth = simulated->truth;
  result.motion = SimulatedTruth(*simulated, *scenario);
  result.options.noise = {scenario->gyro.noise_density_rad_s_rtHz,
                          scenario->gyro.accel_noise_density_m_s2_rtHz};
  result.recording = std::move(simulated->recording);
  result.recording.path = name;
  for (AccelSample& sample : result.recording.accel) {
    sample.accel_gyro_m_s2 += Eigen::Vector3d(0.12, -0.09, 0.06);
  }
  return result;
}

Result<RecordingWithTruth> ReadWithTruth(const std::string& path) {
  Result<Recording> recording = ReadRecording(path);
  if (!recording) return tl::unexpected(recording.error());
  const Result<Calibration> truth = ReadCalibration(path + "/truth.yaml");
  if (!truth) return tl::unexpected(truth.error());
  RecordingWithTruth result;
  const size_t slash = path.find_last_of('/');
  result.name = slash == std::string::npos ? path : path.substr(slash + 1);
  result.truth = *truth;
  if (recording->gyro_info.noise_density_rad_s_rtHz) {
    result.options.noise.gyro_rad_s_rtHz = *recording->gyro_info.noise_density_rad_s_rtHz;
  }
  CameraGuess& camera = recording->camera;
  camera.focal_px = truth->lens[kFocal];
  camera.aspect_ratio = truth->lens[kAspect];
  camera.principal_px = truth->lens.segment<2>(kCx);
  camera.SetDistortion(truth->distortion_model, truth->lens);
  result.recording = *std::move(recording);

  VinsOptions options = result.options;
  Calibration exact = *truth;
  exact.covariance.setZero();
  // Biases at the start of the recording are all that is known of them.
  exact.covariance.diagonal().segment<3>(kStateBias).setConstant(1e-6);
  double sigma_m_s = 0.0;
  result.motion =
      FittedTruth(result.recording, exact, options, kReferenceSpanS, kReferenceStepS, &sigma_m_s);
  std::printf("%s: the reference's own velocities have a sigma of %.4f m/s\n", result.name.c_str(),
              sigma_m_s);
  return result;
}

std::vector<CameraRotation> NeighbourRotations(const Recording& recording,
                                               const Calibration& calibration) {
  std::vector<CameraRotation> rotations;
  const Lens& lens = GetLens(calibration.distortion_model);
  for (const FramePair& pair : PairsFromTracks(recording.tracks, 1)) {
    auto rotation = EstimateCameraRotation(pair, lens, calibration.lens);
    if (!rotation) {  // the search needs an unbroken chain: without the translation then
      TwoViewOptions options;
      options.with_translation = false;
      rotation = EstimateCameraRotation(pair, lens, calibration.lens, options);
    }
    if (rotation) rotations.push_back(*rotation);
  }
  return rotations;
}

}  // namespace camgyro
