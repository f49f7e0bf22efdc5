#include "estimator/window/cross_fit.h"

#include <glog/logging.h>

#include <cmath>

namespace camgyro {

void NeighbourCorrelation::Add(const std::vector<Match>& matches,
                               const std::vector<double>& residuals, double most,
                               const Eigen::Vector2d& size_px) {
  if (residuals.empty()) return;
  CHECK_EQ(matches.size(), residuals.size());
  const double bins_per_px = kBinsPerDiagonal / size_px.norm();
  const double farthest_sq = std::pow((static_cast<double>(kBins) - 1e-9) / bins_per_px, 2);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (std::abs(residuals[i]) > most) continue;
    matches_ += 1.0;
    squares_ += residuals[i] * residuals[i];
    for (size_t k = i + 1; k < matches.size(); ++k) {
      if (std::abs(residuals[k]) > most) continue;
      const double distance_sq = (matches[k].px_b - matches[i].px_b).squaredNorm();
      if (!(distance_sq < farthest_sq)) continue;
      const auto bin = static_cast<size_t>(bins_per_px * std::sqrt(distance_sq));
      pairs_[bin] += 1.0;
      products_[bin] += residuals[i] * residuals[k];
    }
  }
}

NeighbourCorrelation& NeighbourCorrelation::operator+=(const NeighbourCorrelation& other) {
  matches_ += other.matches_;
  squares_ += other.squares_;
  for (size_t i = 0; i < kBins; ++i) {
    pairs_[i] += other.pairs_[i];
    products_[i] += other.products_[i];
  }
  return *this;
}

NeighbourCorrelation NeighbourCorrelation::operator*(double factor) const {
  NeighbourCorrelation scaled = *this;
  scaled.matches_ *= factor;
  scaled.squares_ *= factor;
  for (size_t i = 0; i < kBins; ++i) {
    scaled.pairs_[i] *= factor;
    scaled.products_[i] *= factor;
  }
  return scaled;
}

double NeighbourCorrelation::DesignEffect() const {
  constexpr double kSigmas = 3.0;
  if (!(squares_ > 0.0)) return 1.0;
  double pairs = 0.0, sum = 0.0;
  for (size_t i = 0; i < kBins; ++i) {
    if (products_[i] < 0.0) break;
    pairs += pairs_[i];
    sum += products_[i];
  }
  // A product of two independent errors has the square of their variance.
  const double sigma = squares_ / matches_ * std::sqrt(pairs);
  return sum > kSigmas * sigma ? 1.0 + 2.0 * sum / squares_ : 1.0;
}

}  // namespace camgyro
