#include "estimator/window/noise_scale.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/robust_statistics.h"
#include "estimator/window/gyro_noise.h"

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
  gyro_variance_ = TurnVariancePerS(gyro_sigma_rad_s, interval_s) * MedianInPlace(&gaps);
  least_ = kLeastShareOfGyro * std::sqrt(gyro_variance_);
}

double NoiseScale::Growth(const std::vector<std::vector<double>>& residuals, double scale) const {
  return std::max({1e-3, least_ / scale, RobustScale(residuals, lost_)});
}

std::vector<double> NoiseScale::FactorsOfPairs(const std::vector<std::vector<double>>& differences,
                                               const std::vector<double>& now) const {
  // Variance of the logarithm of the median of n absolute values of a Gaussian, times n.
  constexpr double kVarianceOfOne = 1.36;
  // Of fewer the median tells next to nothing; PairGraph::kMinMatches make so many.
  constexpr size_t kLeastDifferences = 4;
  CHECK_EQ(differences.size(), now.size());
  if (gyro_variance_ > 0.0) return now;
  struct Known {
    size_t pair = 0;
    double log = 0.0, variance = 0.0;
  };
  std::vector<Known> known;
  double mean = 0.0;
  for (size_t i = 0; i < differences.size(); ++i) {
    if (differences[i].size() < kLeastDifferences) continue;
    const double scale = std::max(1e-3, RobustScale({differences[i]}, 0));
    known.push_back(
        {i, std::log(now[i] * scale), kVarianceOfOne / static_cast<double>(differences[i].size())});
    mean += known.back().log;
  }
  std::vector<double> factors(differences.size(), 1.0);
  if (known.size() < 2) return factors;
  mean /= static_cast<double>(known.size());
  double between = 0.0;  // variance that the pairs' noise has of its own
  for (const Known& k : known) {
    between += (std::pow(k.log - mean, 2) - k.variance) / static_cast<double>(known.size() - 1);
  }
  between = std::max(0.0, between);
  for (const Known& k : known) {
    factors[k.pair] = std::exp(between / (between + k.variance) * (k.log - mean));
  }
  return factors;
}

double NoiseScale::Next(const std::vector<std::vector<double>>& residuals, double scale) const {
  if (gyro_variance_ == 0.0) return scale * Growth(residuals, scale);
  const double kept = scale * RobustScale(residuals, lost_);
  const double misfit = kept * (1.0 + gyro_variance_ / (scale * scale));
  const double variance = misfit * misfit - gyro_variance_;
  return std::max({1e-3 * scale, least_, std::sqrt(std::max(0.0, variance))});
}

std::vector<double> NeighbourDifferences(const std::vector<Match>& matches,
                                         const std::vector<double>& residuals) {
  if (residuals.empty()) return {};
  CHECK_EQ(matches.size(), residuals.size());
  std::vector<double> differences;
  std::vector<bool> taken(matches.size(), false);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (taken[i]) continue;
    size_t nearest = i;
    double least = std::numeric_limits<double>::infinity();
    for (size_t k = i + 1; k < matches.size(); ++k) {
      const double distance = (matches[k].px_a - matches[i].px_a).squaredNorm();
      if (taken[k] || !(distance < least)) continue;
      least = distance;
      nearest = k;
    }
    if (nearest == i) break;  // the last one
    taken[nearest] = true;
    differences.push_back((residuals[i] - residuals[nearest]) / std::sqrt(2.0));
  }
  return differences;
}

}  // namespace camgyro
