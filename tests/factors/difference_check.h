// Derivatives of a factor against central differences in the tangent space.
#ifndef CAMGYRO_TESTS_FACTORS_DIFFERENCE_CHECK_H_
#define CAMGYRO_TESTS_FACTORS_DIFFERENCE_CHECK_H_

#include <ceres/cost_function.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <vector>

#include "factors/rotation_manifold.h"

namespace camgyro {

// Compares every column with differences of step `step` (times 1 + |value|), to 1e-4 of the largest
// entry of its block. (ceres::GradientChecker compares entry by entry, and takes the rounding noise
// of an entry that is zero for an error.) Blocks of 4 numbers are rotations, but for `points`.
inline void ExpectJacobiansMatchDifferences(const ceres::CostFunction& factor,
                                            const std::vector<double*>& parameters, double step,
                                            const std::vector<const double*>& points = {}) {
  const int rows = factor.num_residuals();
  const auto& sizes = factor.parameter_block_sizes();
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<RowMajor> jacobians;
  std::vector<double*> pointers;
  for (const int size : sizes) jacobians.emplace_back(RowMajor::Constant(rows, size, std::nan("")));
  for (RowMajor& J : jacobians) pointers.push_back(J.data());
  Eigen::VectorXd r(rows), plus(rows), minus(rows);
  ASSERT_TRUE(factor.Evaluate(parameters.data(), r.data(), pointers.data()));
  ASSERT_TRUE(factor.Evaluate(parameters.data(), plus.data(), nullptr));
  EXPECT_EQ(r, plus) << "residuals differ with and without Jacobians";
  RotationManifold rotation;
  for (size_t k = 0; k < sizes.size(); ++k) {
    const bool is_rotation =
        sizes[k] == 4 && std::find(points.begin(), points.end(), parameters[k]) == points.end();
    const int tangent = is_rotation ? 3 : sizes[k];
    Eigen::MatrixXd analytic = jacobians[k];
    if (is_rotation) analytic = analytic * RotationManifold::PlusJacobianOf(parameters[k]);
    Eigen::MatrixXd numeric(rows, tangent);
    for (int c = 0; c < tangent; ++c) {
      const double h = step * (1.0 + (is_rotation ? 0.0 : std::abs(parameters[k][c])));
      for (const double sign : {1.0, -1.0}) {
        Eigen::VectorXd moved = Eigen::Map<Eigen::VectorXd>(parameters[k], sizes[k]);
        if (is_rotation) {
          const Eigen::Vector3d delta = sign * h * Eigen::Vector3d::Unit(c);
          ASSERT_TRUE(rotation.Plus(parameters[k], delta.data(), moved.data()));
        } else {
          moved[c] += sign * h;
        }
        std::vector<double*> moved_parameters = parameters;
        moved_parameters[k] = moved.data();
        ASSERT_TRUE(
            factor.Evaluate(moved_parameters.data(), (sign > 0 ? plus : minus).data(), nullptr));
      }
      numeric.col(c) = (plus - minus) / (2 * h);
    }
    EXPECT_LT((analytic - numeric).cwiseAbs().maxCoeff(),
              1e-4 * (1e-3 + numeric.cwiseAbs().maxCoeff()))
        << "block " << k;
  }
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FACTORS_DIFFERENCE_CHECK_H_
