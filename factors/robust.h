// The robust loss of the coplanarity residuals.
#ifndef CAMGYRO_FACTORS_ROBUST_H_
#define CAMGYRO_FACTORS_ROBUST_H_

#include <cmath>

namespace camgyro {

// A whitened residual bent so that its square is a robust cost:
//   rho(r^2) = r^2                    for |r| <= threshold
//            = k^2 (2 - k^2 / r^2)    beyond, k = threshold
// Quadratic for the inliers, so that their information is not touched; bounded by 2 k^2, since each
// pair has a direction of its own that bends to outliers where they keep a say (with a logarithmic
// tail 15 % of wrong matches moved the gyro bias by 18 sigma). Bending each residual, instead of a
// ceres::LossFunction on the block, lets one cost function hold all matches of a pair.
// threshold <= 0: no loss.
struct RobustResidual {
  double value = 0.0;       // sign(r) * sqrt(rho)
  double derivative = 1.0;  // of value by r
};

inline RobustResidual Robustify(double r, double threshold) {
  if (threshold <= 0.0 || std::abs(r) <= threshold) return {r, 1.0};
  const double k_sq = threshold * threshold, tail = k_sq / (r * r);
  const double value = threshold * std::sqrt(2.0 - tail);
  return {r > 0.0 ? value : -value, k_sq * tail / (value * std::abs(r))};
}

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_ROBUST_H_
