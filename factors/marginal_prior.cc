#include "factors/marginal_prior.h"

#include <glog/logging.h>

#include <Eigen/Geometry>
#include <utility>

#include "core/so3.h"
#include "factors/rotation_manifold.h"

namespace camgyro {

MarginalPrior::MarginalPrior(std::vector<Block> blocks, Eigen::MatrixXd sqrt_information,
                             Eigen::VectorXd offset)
    : blocks_(std::move(blocks)),
      sqrt_information_(std::move(sqrt_information)),
      offset_(std::move(offset)) {
  int tangent = 0;
  for (const Block& block : blocks_) {
    tangent += block.tangent_size();
    mutable_parameter_block_sizes()->push_back(static_cast<int>(block.linearization.size()));
  }
  CHECK_EQ(sqrt_information_.cols(), tangent);
  CHECK_EQ(sqrt_information_.rows(), offset_.size());
  set_num_residuals(static_cast<int>(offset_.size()));
}

bool MarginalPrior::Evaluate(double const* const* parameters, double* residuals,
                             double** jacobians) const {
  Eigen::VectorXd delta(sqrt_information_.cols());
  int column = 0;
  for (size_t k = 0; k < blocks_.size(); ++k) {
    const Block& block = blocks_[k];
    const int size = block.tangent_size();
    if (block.is_rotation) {
      const Eigen::Quaterniond q{Eigen::Map<const Eigen::Quaterniond>(parameters[k])};
      const Eigen::Quaterniond q_lin(
          Eigen::Map<const Eigen::Quaterniond>(block.linearization.data()));
      delta.segment<3>(column) = Log(Eigen::Quaterniond(q_lin.conjugate() * q.normalized()));
    } else {
      delta.segment(column, size) =
          Eigen::Map<const Eigen::VectorXd>(parameters[k], size) - block.linearization;
    }
    if (jacobians != nullptr && jacobians[k] != nullptr) {
      const auto S = sqrt_information_.middleCols(column, size);
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> J(
          jacobians[k], num_residuals(), block.linearization.size());
      if (block.is_rotation) {
        const Eigen::Vector3d log = delta.segment<3>(column);
        const Eigen::MatrixXd by_tangent = S * RightJacobianInverse(log);
        for (int i = 0; i < num_residuals(); ++i) {
          J.row(i) = RotationManifold::Lift(by_tangent.row(i), parameters[k]);
        }
      } else {
        J = S;
      }
    }
    column += size;
  }
  Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = sqrt_information_ * delta + offset_;
  return true;
}

}  // namespace camgyro
