#include "estimator/window/noise_scale.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>

#include "core/robust_statistics.h"

namespace camgyro {

NoiseScale::NoiseScale(const PairResidual::Facts& residual) : lost_(residual.lost_per_pair) {
  CHECK(!residual.of_attitudes);
}

NoiseScale::NoiseScale(const PairResidual::Facts& residual, const EstimationInput& input,
                       const std::vector<TimedPair>& pairs, const Eigen::Vector3d& gyro_sigma_rad_s)
    : lost_(residual.lost_per_pair) {
  if (!residual.of_attitudes || input.rates.size() < 2) return;
  std::vector<double> gaps;
  for (const TimedPair& pair : pairs) gaps.push_back(pair.time_b_s - pair.time_a_s);
  const double interval_s = (input.rates.back().time_s - input.rates.front().time_s) /
                            static_cast<double>(input.rates.size() - 1);
  gyro_variance_ = gyro_sigma_rad_s.squaredNorm() / 3.0 * interval_s * MedianInPlace(&gaps);
  least_ = kLeastShareOfGyro * std::sqrt(gyro_variance_);
}

double NoiseScale::Growth(const std::vector<std::vector<double>>& residuals, double scale) const {
  return std::max({1e-3, least_ / scale, RobustScale(residuals, lost_)});
}

double NoiseScale::Next(const std::vector<std::vector<double>>& residuals, double scale) const {
  if (gyro_variance_ == 0.0) return scale * Growth(residuals, scale);
  const double kept = scale * RobustScale(residuals, lost_);
  const double misfit = kept * (1.0 + gyro_variance_ / (scale * scale));
  const double variance = misfit * misfit - gyro_variance_;
  return std::max({1e-3 * scale, least_, std::sqrt(std::max(0.0, variance))});
}

}  // namespace camgyro
