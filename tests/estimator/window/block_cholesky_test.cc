#include "estimator/window/block_cholesky.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>

#include "tests/estimator/window/linear_factor.h"

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(BlockCholesky, SolvesAsADenseSolver) {
  // A chain, blocks that are not neighbours (their elimination fills others in), any order.
  const std::vector<int> sizes = {3, 2, 6, 1, 4}, offsets = {0, 3, 5, 11, 12, 16};
  const std::vector<std::vector<int>> touched = {{0, 4, 2}, {3, 1}, {0, 1}, {2}, {3}, {4}, {4, 0}};
  RandomNumbers random(1);
  BlockCholesky cholesky(sizes);
  MatrixXd dense = MatrixXd::Zero(16, 16);
  for (const std::vector<int>& blocks : touched) {
    MatrixXd J(7, 0), wide = MatrixXd::Zero(7, 16);
    for (const int block : blocks) {
      const int size = sizes[static_cast<size_t>(block)];
      const MatrixXd part = random.Matrix(7, size);
      wide.middleCols(offsets[static_cast<size_t>(block)], size) = part;
      J.conservativeResize(7, J.cols() + size);
      J.rightCols(size) = part;
    }
    cholesky.AddSquare(blocks, J);
    dense += wide.transpose() * wide;
  }
  EXPECT_LT((cholesky.Diagonal() - dense.diagonal()).norm(), 1e-12);
  const VectorXd added = random.Vector(16).cwiseAbs();
  cholesky.AddToDiagonal(added);
  dense.diagonal() += added;
  ASSERT_TRUE(cholesky.Factorize());
  const MatrixXd X = random.Matrix(16, 3);
  EXPECT_LT((cholesky.Solve(dense * X) - X).norm(), 1e-9);
}

TEST(BlockCholesky, RefusesWhatIsNotPositiveDefinite) {
  BlockCholesky cholesky({2, 1});
  cholesky.AddSquare({0}, MatrixXd::Identity(2, 2));
  cholesky.AddToDiagonal(Eigen::Vector3d(0.0, 0.0, -1.0));
  EXPECT_FALSE(cholesky.Factorize());
}

}  // namespace
}  // namespace camgyro
