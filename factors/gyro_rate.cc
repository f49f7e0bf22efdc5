#include "factors/gyro_rate.h"

#include <glog/logging.h>

namespace camgyro {

GyroRate::GyroRate(const Eigen::Matrix3Xd& measured_rad_s, const Eigen::Vector3d& sigma_rad_s)
    : measured_(measured_rad_s), inv_sigma_(sigma_rad_s.cwiseInverse()) {
  CHECK_GT(sigma_rad_s.minCoeff(), 0.0);
  CHECK_GT(measured_.cols(), 0);
  const int size = static_cast<int>(measured_.size());
  set_num_residuals(size);
  *mutable_parameter_block_sizes() = {size, 3};
}

bool GyroRate::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  const Eigen::Index n = measured_.cols();
  const Eigen::Map<const Eigen::Matrix3Xd> rates(parameters[0], 3, n);
  const Eigen::Map<const Eigen::Vector3d> bias(parameters[1]);
  Eigen::Map<Eigen::Matrix3Xd>(residuals, 3, n) =
      inv_sigma_.asDiagonal() * ((rates - measured_).colwise() + Eigen::Vector3d(bias));
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::MatrixXd>(jacobians[0], 3 * n, 3 * n) =
        inv_sigma_.replicate(n, 1).asDiagonal();
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>> J(jacobians[1], 3 * n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      J.middleRows<3>(3 * i) = inv_sigma_.asDiagonal();
    }
  }
  return true;
}

}  // namespace camgyro
