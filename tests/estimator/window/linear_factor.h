// A linear cost function on Euclidean blocks: its least-squares problem can be solved on paper.
#ifndef CAMGYRO_TESTS_ESTIMATOR_WINDOW_LINEAR_FACTOR_H_
#define CAMGYRO_TESTS_ESTIMATOR_WINDOW_LINEAR_FACTOR_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>
#include <random>
#include <utility>
#include <vector>

namespace camgyro {

//   r = A_1 x_1 + A_2 x_2 + ... - b
class LinearFactor final : public ceres::CostFunction {
 public:
  LinearFactor(std::vector<Eigen::MatrixXd> matrices, Eigen::VectorXd b)
      : matrices_(std::move(matrices)), b_(std::move(b)) {
    for (const Eigen::MatrixXd& A : matrices_) {
      mutable_parameter_block_sizes()->push_back(static_cast<int>(A.cols()));
    }
    set_num_residuals(static_cast<int>(b_.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> r(residuals, b_.size());
    r = -b_;
    for (size_t k = 0; k < matrices_.size(); ++k) {
      const Eigen::MatrixXd& A = matrices_[k];
      r += A * Eigen::Map<const Eigen::VectorXd>(parameters[k], A.cols());
      if (jacobians == nullptr || jacobians[k] == nullptr) continue;
      for (Eigen::Index i = 0; i < A.rows(); ++i) {
        for (Eigen::Index j = 0; j < A.cols(); ++j) jacobians[k][i * A.cols() + j] = A(i, j);
      }
    }
    return true;
  }

 private:
  const std::vector<Eigen::MatrixXd> matrices_;
  const Eigen::VectorXd b_;
};

class RandomNumbers {
 public:
  explicit RandomNumbers(uint64_t seed) : generator_(seed) {}
  Eigen::MatrixXd Matrix(Eigen::Index rows, Eigen::Index cols) {
    Eigen::MatrixXd m(rows, cols);
    for (Eigen::Index c = 0; c < cols; ++c) {
      for (Eigen::Index r = 0; r < rows; ++r) m(r, c) = normal_(generator_);
    }
    return m;
  }
  Eigen::VectorXd Vector(Eigen::Index rows) { return Matrix(rows, 1); }
  // Random factor of `rows` residuals on blocks of these sizes.
  std::shared_ptr<LinearFactor> Factor(Eigen::Index rows, const std::vector<Eigen::Index>& sizes) {
    std::vector<Eigen::MatrixXd> matrices;
    for (const Eigen::Index size : sizes) matrices.push_back(Matrix(rows, size));
    return std::make_shared<LinearFactor>(std::move(matrices), Vector(rows));
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_ESTIMATOR_WINDOW_LINEAR_FACTOR_H_
