// Cholesky factorisation of sparse normal equations in dense blocks.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_BLOCK_CHOLESKY_H_
#define CAMGYRO_ESTIMATOR_WINDOW_BLOCK_CHOLESKY_H_

#include <Eigen/Core>
#include <map>
#include <vector>

namespace camgyro {

// A symmetric positive definite matrix of which few blocks are filled: the information of a
// FactorGraph, whose covariance needs the influence of every factor. Blocks are eliminated in the
// order of their numbers, without reordering: put first what has the fewest neighbours.
class BlockCholesky {
 public:
  // Zero matrix with blocks of these sizes.
  explicit BlockCholesky(std::vector<int> sizes);

  // Adds J^T J, J's columns being those of `blocks` (numbers, each once) side by side.
  void AddSquare(const std::vector<int>& blocks, const Eigen::MatrixXd& J);
  Eigen::VectorXd Diagonal() const;
  void AddToDiagonal(const Eigen::VectorXd& values);

  // Replaces the matrix by its factor; false if it is not positive definite.
  [[nodiscard]] bool Factorize();
  // The inverse of the factorised matrix times X.
  Eigen::MatrixXd Solve(Eigen::MatrixXd X) const;

 private:
  std::vector<int> sizes_, offsets_;
  std::vector<std::map<int, Eigen::MatrixXd>> columns_;  // lower triangle: blocks by their row
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_BLOCK_CHOLESKY_H_
