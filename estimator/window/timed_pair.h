// Gyro samples and pairs of frames as the estimators take them: in seconds from one origin.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_TIMED_PAIR_H_
#define CAMGYRO_ESTIMATOR_WINDOW_TIMED_PAIR_H_

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/pair_model.h"
#include "core/recording.h"

namespace camgyro {

// One gyro sample.
struct TimedRate {
  double time_s = 0.0;
  Eigen::Vector3d omega_gyro_rad_s = Eigen::Vector3d::Zero();
  bool saturated = false;  // at the gyro's full scale: no pair may need it
};

// Two frames by their recorded stamps.
struct TimedPair {
  int64_t id = 0;  // ascending with time_a_s
  int frame_a = 0, frame_b = 0;
  double time_a_s = 0.0, time_b_s = 0.0;
  double exposure_a_s = std::numeric_limits<double>::quiet_NaN();  // NaN: not recorded
  double exposure_b_s = std::numeric_limits<double>::quiet_NaN();
  std::vector<Match> matches;  // empty for rotations, and of an outline (OutlineOf)
  size_t num_matches = 0;      // of the recording, also where `matches` is empty
  CameraRotation rotation;     // of recordings with attitudes
  // Of its matches, in units of what the recording has: NoiseScale::FactorsOfPairs.
  double noise_factor = 1.0;

  FrameTime first() const { return {time_a_s, exposure_a_s}; }
  FrameTime second() const { return {time_b_s, exposure_b_s}; }
  bool of_attitudes() const { return matches.empty() && rotation.frame_b > rotation.frame_a; }
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_TIMED_PAIR_H_
