// A Gaussian prior of some parameter blocks, each coordinate with a sigma of its own.
#ifndef CAMGYRO_FACTORS_GAUSSIAN_PRIOR_H_
#define CAMGYRO_FACTORS_GAUSSIAN_PRIOR_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <vector>

namespace camgyro {

//   r = (x [-] mean) / sigma
//
// Parameters  the blocks in the order given; a rotation block (4, [x y z w]) enters by its tangent,
//             the others by their difference
// Residual    one per coordinate of the tangents, in sigmas
// Source      docs/architecture.md, conventions. The derivative of [-] includes the inverse right
//             Jacobian. Neglects: correlations; what marginalised factors say has them
//             (MarginalPrior)
class GaussianPrior final : public ceres::CostFunction {
 public:
  struct Block {
    Eigen::VectorXd mean;  // ambient values
    // One per coordinate of the tangent, > 0 (CHECKed); infinity: nothing is known.
    Eigen::VectorXd sigma;
    bool is_rotation = false;
  };

  explicit GaussianPrior(std::vector<Block> blocks);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const std::vector<Block> blocks_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_GAUSSIAN_PRIOR_H_
