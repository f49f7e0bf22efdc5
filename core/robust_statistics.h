// Medians and the scale of residuals that outliers do not move.
#ifndef CAMGYRO_CORE_ROBUST_STATISTICS_H_
#define CAMGYRO_CORE_ROBUST_STATISTICS_H_

#include <vector>

namespace camgyro {

// Median (the upper one of an even number); reorders. CHECKs nothing: values must not be empty.
double MedianInPlace(std::vector<double>* values);

// Standard deviation of a Gaussian with the same median magnitude as the residuals of several
// groups. Each group lost `lost_per_group` degrees of freedom to parameters of its own; groups
// without more residuals than that are left out. 0 without residuals.
double RobustScale(const std::vector<std::vector<double>>& groups, int lost_per_group);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_ROBUST_STATISTICS_H_
