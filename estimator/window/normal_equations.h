// Gauss-Newton's equations of a ceres::Problem in dense blocks, and what each factor adds to them.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_NORMAL_EQUATIONS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_NORMAL_EQUATIONS_H_

#include <ceres/problem.h>

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "estimator/window/block_cholesky.h"
#include "estimator/window/factor_graph.h"

namespace camgyro {

// A factor at the values of its blocks.
struct FactorValue {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd J;  // by the tangents of its blocks, side by side
};

// False where the factor has no value.
[[nodiscard]] bool EvaluateFactor(const ceres::Problem& problem,
                                  const std::map<BlockId, Block>& blocks, const Factor& factor,
                                  FactorValue* value);

// The blocks that some factors touch, sorted.
std::vector<BlockId> BlocksOf(const std::vector<const Factor*>& factors);

// The unknowns of some factors in the order of elimination: bends, directions, frames' own times
// and rates from the last to the first, and what all share.
struct Unknowns {
  Unknowns(const std::map<BlockId, Block>& blocks, const std::vector<const Factor*>& factors);

  std::vector<BlockId> ids;
  std::map<BlockId, int> numbers;
  std::vector<int> sizes, offsets;
  int size = 0;
  std::vector<std::vector<int>> of_factors;  // numbers of the unknowns of each factor
};

// information * x = -gradient at the values of the blocks.
struct NormalEquations {
  explicit NormalEquations(const Unknowns& unknowns)
      : information(unknowns.sizes), gradient(Eigen::VectorXd::Zero(unknowns.size)) {}

  BlockCholesky information;
  Eigen::VectorXd gradient;
  std::vector<Eigen::VectorXd> gradients;  // of each factor, by its own unknowns
  double cost = 0.0;                       // half the sum of squares
};

// Nothing where a factor has no value.
std::optional<NormalEquations> MakeNormalEquations(const ceres::Problem& problem,
                                                   const std::map<BlockId, Block>& blocks,
                                                   const std::vector<const Factor*>& factors,
                                                   const Unknowns& unknowns);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_NORMAL_EQUATIONS_H_
