// The robust loss of the coplanarity residuals.
#ifndef CAMGYRO_FACTORS_ROBUST_H_
#define CAMGYRO_FACTORS_ROBUST_H_

#include <cmath>

namespace camgyro {

// A whitened residual bent so that its square is a robust cost:
//   rho(r^2) = r^2                          for |r| <= threshold
//            = k^2 (1 + log(r^2 / k^2))     beyond, k = threshold
// Quadratic for the inliers, so that their information is not touched; redescending like Cauchy's
// loss in the tails. Bending each residual, instead of a ceres::LossFunction on the block, lets one
// cost function hold all matches of a pair. threshold <= 0: no loss.
struct RobustResidual {
  double value = 0.0;       // sign(r) * sqrt(rho)
  double derivative = 1.0;  // of value by r
};

inline RobustResidual Robustify(double r, double threshold) {
  if (threshold <= 0.0 || std::abs(r) <= threshold) return {r, 1.0};
  const double ratio_sq = r * r / (threshold * threshold);
  const double value = threshold * std::sqrt(1.0 + std::log(ratio_sq));
  return {r > 0.0 ? value : -value, threshold * threshold / (value * std::abs(r))};
}

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_ROBUST_H_
