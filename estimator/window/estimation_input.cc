#include "estimator/window/estimation_input.h"

#include <algorithm>
#include <cmath>

#include "core/time.h"

namespace camgyro {

EstimationInput MakeEstimationInput(const Recording& recording, int attitude_gap) {
  EstimationInput input;
  input.origin_ns = recording.gyro.front().stamp_ns;
  for (const GyroSample& sample : recording.gyro) {
    input.rates.push_back(
        {SecondsSince(input.origin_ns, sample.stamp_ns), sample.omega_gyro_rad_s});
  }
  const auto add = [&](int a, int b) -> TimedPair& {
    TimedPair pair;
    pair.id = static_cast<int64_t>(input.pairs.size());
    pair.frame_a = a;
    pair.frame_b = b;
    pair.time_a_s =
        SecondsSince(input.origin_ns, recording.frames[static_cast<size_t>(a)].stamp_ns);
    pair.time_b_s =
        SecondsSince(input.origin_ns, recording.frames[static_cast<size_t>(b)].stamp_ns);
    input.pairs.push_back(std::move(pair));
    return input.pairs.back();
  };
  if (!recording.matches.empty() || !recording.tracks.empty()) {
    const std::vector<FramePair> pairs =
        recording.matches.empty() ? PairsFromTracks(recording.tracks, 1) : recording.matches;
    for (const FramePair& pair : pairs) add(pair.frame_a, pair.frame_b).matches = pair.matches;
  } else {
    const int n = static_cast<int>(recording.q_cam_world.size());
    for (int a = 0; a + attitude_gap < n; a += attitude_gap) {
      CameraRotation& rotation = add(a, a + attitude_gap).rotation;
      rotation.frame_a = a;
      rotation.frame_b = a + attitude_gap;
      rotation.q_a_b = recording.q_cam_world[static_cast<size_t>(a)] *
                       recording.q_cam_world[static_cast<size_t>(a + attitude_gap)].conjugate();
    }
  }
  return input;
}

double GyroSigma(const Recording& recording) {
  const double interval = MedianInterval(recording.gyro);
  if (recording.gyro_info.noise_density_rad_s_rtHz && interval > 0.0) {
    return *recording.gyro_info.noise_density_rad_s_rtHz / std::sqrt(interval);
  }
  std::vector<double> differences;
  const auto& gyro = recording.gyro;
  for (size_t i = 3; i < gyro.size(); ++i) {
    const Eigen::Vector3d d = gyro[i].omega_gyro_rad_s - 3.0 * gyro[i - 1].omega_gyro_rad_s +
                              3.0 * gyro[i - 2].omega_gyro_rad_s - gyro[i - 3].omega_gyro_rad_s;
    for (int k = 0; k < 3; ++k) differences.push_back(std::abs(d[k]));
  }
  if (differences.empty()) return 0.003;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  // Third differences of white noise have a variance of 1 + 9 + 9 + 1.
  return std::clamp(1.4826 * *middle / std::sqrt(20.0), 5e-4, 2e-2);
}

}  // namespace camgyro
