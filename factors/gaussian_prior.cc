#include "factors/gaussian_prior.h"

#include <glog/logging.h>

#include <Eigen/Geometry>
#include <utility>

#include "core/so3.h"
#include "factors/rotation_manifold.h"

namespace camgyro {

GaussianPrior::GaussianPrior(std::vector<Block> blocks) : blocks_(std::move(blocks)) {
  int residuals = 0;
  for (const Block& block : blocks_) {
    CHECK_EQ(block.sigma.size(), block.is_rotation ? 3 : block.mean.size());
    CHECK((block.sigma.array() > 0.0).all());
    residuals += static_cast<int>(block.sigma.size());
    mutable_parameter_block_sizes()->push_back(static_cast<int>(block.mean.size()));
  }
  set_num_residuals(residuals);
}

bool GaussianPrior::Evaluate(double const* const* parameters, double* residuals,
                             double** jacobians) const {
  Eigen::Index row = 0;
  for (size_t k = 0; k < blocks_.size(); ++k) {
    const Block& block = blocks_[k];
    const Eigen::Index size = block.sigma.size();
    const Eigen::VectorXd inv_sigma = block.sigma.cwiseInverse();
    Eigen::VectorXd delta(size);
    if (block.is_rotation) {
      const Eigen::Quaterniond q = Eigen::Map<const Eigen::Quaterniond>(parameters[k]);
      const Eigen::Quaterniond q_mean(Eigen::Map<const Eigen::Quaterniond>(block.mean.data()));
      delta = Log(Eigen::Quaterniond(q_mean.conjugate() * q.normalized()));
    } else {
      delta = Eigen::Map<const Eigen::VectorXd>(parameters[k], size) - block.mean;
    }
    Eigen::Map<Eigen::VectorXd>(residuals + row, size) = inv_sigma.cwiseProduct(delta);
    if (jacobians != nullptr && jacobians[k] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> J(
          jacobians[k], num_residuals(), block.mean.size());
      J.setZero();
      if (block.is_rotation) {
        const Eigen::Matrix3d by_tangent =
            inv_sigma.asDiagonal() * RightJacobianInverse(Eigen::Vector3d(delta));
        for (int i = 0; i < 3; ++i) {
          J.row(row + i) = RotationManifold::Lift(by_tangent.row(i), parameters[k]);
        }
      } else {
        J.middleRows(row, size).diagonal() = inv_sigma;
      }
    }
    row += size;
  }
  return true;
}

}  // namespace camgyro
