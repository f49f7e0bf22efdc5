#include "core/robust_statistics.h"

#include <cmath>
#include <utility>

namespace camgyro {

double RobustScale(const std::vector<std::vector<double>>& groups, int lost_per_group) {
  std::vector<double> magnitudes;
  for (const auto& group : groups) {
    const auto n = static_cast<double>(group.size());
    if (n <= lost_per_group) continue;
    const double correction = std::sqrt(n / (n - lost_per_group));
    for (const double r : group) magnitudes.push_back(std::abs(r) * correction);
  }
  return kSigmaOfMedian * MedianOr(std::move(magnitudes), 0.0);
}

}  // namespace camgyro
