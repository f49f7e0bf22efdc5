#include "factors/marginal_prior.h"

#include <ceres/sphere_manifold.h>
#include <glog/logging.h>

#include <Eigen/Geometry>
#include <utility>

#include "core/so3.h"
#include "factors/rotation_manifold.h"

namespace camgyro {
namespace {

using PointTangent = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

// From a small change of a unit vector to the tangent that ceres::Problem has there.
PointTangent TangentOf(const Eigen::Vector4d& unit) {
  PointTangent tangent;
  ceres::SphereManifold<4>().MinusJacobian(unit.data(), tangent.data());
  return tangent;
}

}  // namespace

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
    if (block.kind == Kind::kRotation) {
      const Eigen::Quaterniond q{Eigen::Map<const Eigen::Quaterniond>(parameters[k])};
      const Eigen::Quaterniond q_lin(
          Eigen::Map<const Eigen::Quaterniond>(block.linearization.data()));
      delta.segment<3>(column) = Log(Eigen::Quaterniond(q_lin.conjugate() * q.normalized()));
    } else if (block.kind == Kind::kHomogeneousPoint) {
      const Eigen::Map<const Eigen::Vector4d> x(parameters[k]);
      const double cosine = x.dot(block.linearization);
      if (!(cosine > 0.0)) return false;
      delta.segment<3>(column) = TangentOf(block.linearization) * x / cosine;
    } else {
      delta.segment(column, size) =
          Eigen::Map<const Eigen::VectorXd>(parameters[k], size) - block.linearization;
    }
    if (jacobians != nullptr && jacobians[k] != nullptr) {
      const auto S = sqrt_information_.middleCols(column, size);
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> J(
          jacobians[k], num_residuals(), block.linearization.size());
      if (block.kind == Kind::kRotation) {
        const Eigen::Vector3d log = delta.segment<3>(column);
        const Eigen::MatrixXd by_tangent = S * RightJacobianInverse(log);
        for (int i = 0; i < num_residuals(); ++i) {
          J.row(i) = RotationManifold::Lift(by_tangent.row(i), parameters[k]);
        }
      } else if (block.kind == Kind::kHomogeneousPoint) {
        const Eigen::Map<const Eigen::Vector4d> x(parameters[k]);
        const double cosine = x.dot(block.linearization);
        J = S *
            (TangentOf(block.linearization) -
             delta.segment<3>(column) * block.linearization.transpose()) /
            cosine;
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
