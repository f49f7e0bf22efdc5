#include "factors/bias_walk.h"

#include <glog/logging.h>

#include <Eigen/Core>
#include <cmath>

namespace camgyro {

BiasWalk::BiasWalk(double density_rad_s2_rtHz, double interval_s)
    : inv_sigma_(1.0 / (density_rad_s2_rtHz * std::sqrt(interval_s))) {
  CHECK_GT(density_rad_s2_rtHz, 0.0);
  CHECK_GT(interval_s, 0.0);
}

bool BiasWalk::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  Eigen::Map<Eigen::Vector3d>(residuals, 3) =
      inv_sigma_ * (Eigen::Map<const Eigen::Vector3d>(parameters[1]) -
                    Eigen::Map<const Eigen::Vector3d>(parameters[0]));
  if (jacobians == nullptr) return true;
  for (int block = 0; block < 2; ++block) {
    if (jacobians[block] == nullptr) continue;
    Eigen::Map<Eigen::Matrix3d>(jacobians[block], 3, 3) =
        (block == 0 ? -inv_sigma_ : inv_sigma_) * Eigen::Matrix3d::Identity();
  }
  return true;
}

}  // namespace camgyro
