#include "estimator/vins/initialise.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/format.h"
#include "core/pair_model.h"
#include "estimator/vins/alignment.h"
#include "estimator/vins/structure.h"
#include "estimator/vins/vins_refinement.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

constexpr double kMinExcitationMS2 = 0.05;
constexpr double kMinParallaxRad = 0.01;
constexpr double kMinParallaxNoises = 5.0;
// The mean specific force of a second or more is gravity, but for the change of velocity.
constexpr double kMaxGravityErrorMS2 = 3.0;
constexpr double kMaxAccelNoiseFactor = 15.0;
constexpr double kMinInlierRatio = 0.5;
constexpr double kMaxNoiseRad = 5e-3;  // of a tracked point: 3 px at 600 px of focal length

// Mean specific force of each interval between keyframes, in the world frame.
Eigen::Matrix3Xd MeanForces(const VinsWindow& window) {
  const auto intervals = static_cast<Eigen::Index>(window.keyframes.size()) - 1;
  Eigen::Matrix3Xd forces(3, intervals);
  for (Eigen::Index i = 0; i < intervals; ++i) {
    const VinsKeyframe& from = window.keyframes[static_cast<size_t>(i)];
    const VinsKeyframe& to = window.keyframes[static_cast<size_t>(i) + 1];
    const ImuDelta delta = window.imu.Between(from.time_s, to.time_s);
    forces.col(i) = from.q_world_gyro * delta.dv / delta.dt_s;
  }
  return forces;
}

// An accelerometer that covers the keyframes without holes.
bool Covers(const std::vector<AccelSample>& accel, const VinsWindow& window) {
  double last_s = -1e18, widest_s = 0.0;
  bool begun = false;
  for (const AccelSample& sample : accel) {
    const double time_s = 1e-9 * static_cast<double>(sample.stamp_ns - window.origin_ns);
    if (begun) widest_s = std::max(widest_s, time_s - last_s);
    begun = true;
    last_s = time_s;
  }
  const double first_s =
      accel.empty() ? 1e18 : 1e-9 * static_cast<double>(accel.front().stamp_ns - window.origin_ns);
  return first_s <= window.keyframes.front().time_s && last_s >= window.keyframes.back().time_s &&
         widest_s <= 0.05;
}

VinsStart Refuse(const VinsStart& so_far, VinsVerdict verdict, std::string explanation) {
  VinsStart start = so_far;
  start.verdict = verdict;
  start.explanation = std::move(explanation);
  return start;
}

// What a refined start is worth.
Result<VinsStart> Judge(VinsStart start, const VinsOptions& options) {
  if (start.inlier_ratio < kMinInlierRatio ||
      start.noise_px > kMaxNoiseRad * start.calibration.lens[kFocal]) {
    return Refuse(
        start, VinsVerdict::kCalibrationImplausible,
        Format("%.0f %% of the tracked points agree with the gyro's rotations, to %.1f px: "
               "wrong delay, mounting, lens or readout time?",
               100.0 * start.inlier_ratio, start.noise_px));
  }
  if (start.accel_noise_factor > kMaxAccelNoiseFactor) {
    return Refuse(
        start, VinsVerdict::kAccelerometerImplausible,
        Format("the accelerometer contradicts camera and gyro %.0f times beyond its noise: "
               "wrong axes, scale, clock, or calibration",
               start.accel_noise_factor));
  }
  if (!(start.scale_sigma <= options.ready_scale) ||
      !(start.gravity_sigma_rad <= options.ready_gravity_rad)) {
    const std::string explanation =
        Format("known so far: scale to %.1f %%, gravity to %.2f deg; wanted: %.1f %%, %.2f deg",
               100.0 * start.scale_sigma, start.gravity_sigma_rad * 180.0 / M_PI,
               100.0 * options.ready_scale, options.ready_gravity_rad * 180.0 / M_PI);
    return Refuse(start, VinsVerdict::kImprecise, explanation);
  }
  start.verdict = VinsVerdict::kReady;
  start.explanation =
      Format("scale to %.1f %%, gravity to %.2f deg, %d landmarks", 100.0 * start.scale_sigma,
             start.gravity_sigma_rad * 180.0 / M_PI, static_cast<int>(start.landmarks.size()));
  return start;
}

}  // namespace

std::string VinsVerdictName(VinsVerdict verdict) {
  switch (verdict) {
    case VinsVerdict::kReady:
      return "ready";
    case VinsVerdict::kNoAccelerometer:
      return "no_accelerometer";
    case VinsVerdict::kTooFewTracks:
      return "too_few_tracks";
    case VinsVerdict::kTooLittleExcitation:
      return "too_little_excitation";
    case VinsVerdict::kTooLittleParallax:
      return "too_little_parallax";
    case VinsVerdict::kAccelerometerImplausible:
      return "accelerometer_implausible";
    case VinsVerdict::kCalibrationImplausible:
      return "calibration_implausible";
    case VinsVerdict::kImprecise:
      return "imprecise";
    case VinsVerdict::kNotConverged:
      return "not_converged";
  }
  return "";
}

Result<VinsStart> InitialiseVins(const VinsInput& input, const VinsOptions& options) {
  if (ReadsColumns(input.calibration.readout_s, ColumnReadoutOf(input.calibration))) {
    return BadInput(std::string("calibration: ") + kReadsColumns);
  }
  VinsStart start;
  start.calibration = input.calibration;
  const Result<VinsWindow> window = MakeVinsWindow(input, options.keyframe_interval_s);
  if (!window) {
    if (window.error().kind == ErrorKind::kBadInput) return tl::unexpected(window.error());
    return Refuse(start, VinsVerdict::kTooFewTracks, window.error().message);
  }
  if (!Covers(input.accel, *window)) {
    return Refuse(start, VinsVerdict::kNoAccelerometer,
                  input.accel.empty()
                      ? "there is no accelerometer: scale and gravity cannot be known"
                      : "the accelerometer's samples do not cover the window without holes");
  }

  // (a)
  const Eigen::Matrix3Xd forces = MeanForces(*window);
  const Vector3d mean = forces.rowwise().mean();
  start.excitation_m_s2 =
      std::sqrt((forces.colwise() - mean).squaredNorm() / static_cast<double>(forces.cols()));
  if (std::abs(mean.norm() - options.gravity_m_s2) > kMaxGravityErrorMS2) {
    return Refuse(start, VinsVerdict::kAccelerometerImplausible,
                  Format("the mean specific force is %.2f m/s^2 where gravity alone makes %.2f: "
                         "another unit, axes that do not turn with the gyro's, or gravity already "
                         "taken out?",
                         mean.norm(), options.gravity_m_s2));
  }
  if (start.excitation_m_s2 < kMinExcitationMS2) {
    return Refuse(
        start, VinsVerdict::kTooLittleExcitation,
        Format("the accelerometer feels hardly more than gravity (changes of %.3f m/s^2): "
               "move with changing speed to make the scale known",
               start.excitation_m_s2));
  }

  // (b)
  const Result<VinsStructure> structure = FindStructure(*window);
  if (!structure) {
    return Refuse(start, VinsVerdict::kTooFewTracks, structure.error().message);
  }
  start.parallax_rad = structure->parallax_rad;
  if (start.parallax_rad < kMinParallaxRad) {
    return Refuse(start, VinsVerdict::kTooLittleParallax,
                  Format("the camera hardly moves: points are seen under angles that differ by "
                         "%.2f deg only (median)",
                         start.parallax_rad * 180.0 / M_PI));
  }
  if (start.parallax_rad < kMinParallaxNoises * structure->noise_rad) {
    return Refuse(
        start, VinsVerdict::kCalibrationImplausible,
        Format("directions to tracked points scatter by %.2f deg with the gyro's rotations "
               "taken out: wrong delay, mounting, lens or readout time?",
               structure->noise_rad * 180.0 / M_PI));
  }

  // (c) and gravity's length
  const Result<VinsAlignment> alignment =
      AlignWithInertial(*window, *structure, options.p_gyro_cam_m, options.accel_bias_sigma_m_s2,
                        options.gravity_m_s2);
  if (!alignment) {
    return Refuse(start, VinsVerdict::kAccelerometerImplausible, alignment.error().message);
  }

  // (d)
  if (Status refined = RefineVins(*window, *structure, *alignment, options, &start); !refined) {
    return Refuse(start, VinsVerdict::kNotConverged, refined.error().message);
  }
  for (size_t k = 0; k < start.states.size(); ++k) {
    start.states[k].frame_stamp_ns =
        input.frame_stamps_ns[static_cast<size_t>(window->keyframes[k].frame)];
  }
  start.inlier_ratio =
      static_cast<double>(start.observations) / static_cast<double>(window->observations.size());
  return Judge(std::move(start), options);
}

}  // namespace camgyro
