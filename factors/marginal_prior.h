// What marginalised factors say about the blocks that stay.
#ifndef CAMGYRO_FACTORS_MARGINAL_PRIOR_H_
#define CAMGYRO_FACTORS_MARGINAL_PRIOR_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <vector>

namespace camgyro {

//   r = S * [ x_1 [-] x_1,lin; x_2 [-] x_2,lin; ... ] + r_0
//
// Parameters  the blocks that stay, in the order given; a rotation (4, [x y z w]) enters by its
//             tangent, a homogeneous point (4, unit norm) by x / (x . x_lin) in the tangent of
//             ceres::SphereManifold at x_lin, the others by their difference
// Residual    rows of S, in sigmas
// Source      square-root form of the Schur complement; see estimator/window/marginalize.h.
//             The derivative of [-] includes the inverse right Jacobian. Cannot be evaluated for
//             a point at 90 deg or more from x_lin
class MarginalPrior final : public ceres::CostFunction {
 public:
  enum class Kind { kVector, kRotation, kHomogeneousPoint };
  struct Block {
    Eigen::VectorXd linearization;  // ambient values
    Kind kind = Kind::kVector;
    int tangent_size() const {
      return kind == Kind::kVector ? static_cast<int>(linearization.size()) : 3;
    }
  };

  // sqrt_information: rows x sum of tangent sizes; offset: rows.
  MarginalPrior(std::vector<Block> blocks, Eigen::MatrixXd sqrt_information,
                Eigen::VectorXd offset);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  const Eigen::MatrixXd& sqrt_information() const { return sqrt_information_; }
  const Eigen::VectorXd& offset() const { return offset_; }
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  const std::vector<Block> blocks_;
  const Eigen::MatrixXd sqrt_information_;
  const Eigen::VectorXd offset_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_MARGINAL_PRIOR_H_
