#include "estimator/window/gyro_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/robust_statistics.h"
#include "core/time.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {
namespace {

// Samples are rounded; those of a gyro at rest may be all the same [rad/s].
constexpr double kLeastSigma = 5e-4;
// Of so many differences the robust scale is good to 10 %.
constexpr size_t kLeastDifferences = 200;

using Rates = std::vector<Eigen::Vector3d>;

// Means over `count` samples, one after the other.
Rates MeansOf(const Rates& rates, size_t count) {
  Rates means;
  for (size_t first = 0; first + count <= rates.size(); first += count) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < count; ++i) sum += rates[first + i];
    means.emplace_back(sum / static_cast<double>(count));
  }
  return means;
}

Eigen::Vector3d SigmaOfThirdDifferences(const Rates& rates) {
  Eigen::Vector3d sigma;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> differences;
    for (size_t i = 3; i < rates.size(); ++i) {
      differences.push_back(rates[i][k] - 3.0 * rates[i - 1][k] + 3.0 * rates[i - 2][k] -
                            rates[i - 3][k]);
    }
    // Those of white noise have a variance of 1 + 9 + 9 + 1.
    sigma[k] = RobustScale({differences}, 0) / std::sqrt(20.0);
  }
  return sigma;
}

}  // namespace

Eigen::Vector3d ShownGyroSigma(const Recording& recording, double delay_s) {
  const int64_t first_ns = StampAt(recording.frames.front().stamp_ns, delay_s);
  const int64_t last_ns = StampAt(recording.frames.back().stamp_ns, delay_s);
  Rates rates;
  for (const GyroSample& sample : recording.gyro) {
    if (sample.stamp_ns < first_ns || sample.stamp_ns > last_ns) continue;
    rates.push_back(sample.omega_gyro_rad_s);
  }
  const double interval_s = MedianInterval(recording.gyro);
  const double longest_s = PairGraphOptions().rate_step_s;
  Eigen::Vector3d least = SigmaOfThirdDifferences(rates);
  for (size_t count = 2; static_cast<double>(count) * interval_s <= longest_s &&
                         rates.size() / count >= kLeastDifferences + 3;
       count *= 2) {
    least = least.cwiseMin(std::sqrt(static_cast<double>(count)) *
                           SigmaOfThirdDifferences(MeansOf(rates, count)));
  }
  return least.cwiseMax(kLeastSigma);
}

Eigen::Vector3d GyroSigma(const Recording& recording, double delay_s) {
  const double interval_s = MedianInterval(recording.gyro);
  if (recording.gyro_info.noise_density_rad_s_rtHz && interval_s > 0.0) {
    return Eigen::Vector3d::Constant(*recording.gyro_info.noise_density_rad_s_rtHz /
                                     std::sqrt(interval_s));
  }
  return ShownGyroSigma(recording, delay_s);
}

double TurnVariancePerS(const Eigen::Vector3d& sigma_rad_s, double interval_s) {
  return sigma_rad_s.squaredNorm() / 3.0 * interval_s;
}

}  // namespace camgyro
