#include "core/robust_statistics.h"

#include <algorithm>
#include <cmath>

namespace camgyro {

double MedianInPlace(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

double RobustScale(const std::vector<std::vector<double>>& groups, int lost_per_group) {
  std::vector<double> magnitudes;
  for (const auto& group : groups) {
    const auto n = static_cast<double>(group.size());
    if (n <= lost_per_group) continue;
    const double correction = std::sqrt(n / (n - lost_per_group));
    for (const double r : group) magnitudes.push_back(std::abs(r) * correction);
  }
  // 1.4826 = 1 / (the 75 % quantile of the unit Gaussian).
  return magnitudes.empty() ? 0.0 : 1.4826 * MedianInPlace(&magnitudes);
}

}  // namespace camgyro
