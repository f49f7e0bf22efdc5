// Medians and the scale of residuals that outliers do not move.
#ifndef CAMGYRO_CORE_ROBUST_STATISTICS_H_
#define CAMGYRO_CORE_ROBUST_STATISTICS_H_

#include <algorithm>
#include <cstddef>
#include <vector>

namespace camgyro {

// Standard deviation of a Gaussian by the median of its magnitudes: 1 / (its 75 % quantile).
constexpr double kSigmaOfMedian = 1.4826;

// Median (the upper one of an even number); reorders. CHECKs nothing: values must not be empty.
template <typename T>
T MedianInPlace(std::vector<T>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

// The same of a copy; `none` without values.
inline double MedianOr(std::vector<double> values, double none) {
  return values.empty() ? none : MedianInPlace(&values);
}

// Standard deviation of a Gaussian with the same median magnitude as the residuals of several
// groups. Each group lost `lost_per_group` degrees of freedom to parameters of its own; groups
// without more residuals than that are left out. 0 without residuals.
double RobustScale(const std::vector<std::vector<double>>& groups, int lost_per_group);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_ROBUST_STATISTICS_H_
