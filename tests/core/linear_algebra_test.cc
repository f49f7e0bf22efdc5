#include "core/linear_algebra.h"

#include <gtest/gtest.h>

#include <cmath>

namespace camgyro {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

TEST(SquaredMahalanobis, IsThatOfTheCovariance) {
  Matrix2d covariance;
  covariance << 4.0, 1.0, 1.0, 1.0;  // inverse: [1 -1; -1 4] / 3
  EXPECT_NEAR(SquaredMahalanobis(Vector2d(1.0, 2.0), covariance), 13.0 / 3.0, 1e-12);
}

TEST(SquaredMahalanobis, UnitsMayDifferByOrdersOfMagnitude) {
  Matrix2d covariance;
  covariance << 4.0, 1.0, 1.0, 1.0;
  const Vector2d unit(1e9, 1e-9);
  const Matrix2d scaled = unit.asDiagonal() * covariance * unit.asDiagonal();
  EXPECT_NEAR(SquaredMahalanobis(Vector2d(1e9, 2e-9), scaled), 13.0 / 3.0, 1e-9);
}

// Units of 1e9 and 1e-9 beside each other.
MatrixXd WideScales() {
  MatrixXd A(3, 3);
  A << 4.0, 1.0, 0.5, 1.0, 3.0, -1.0, 0.5, -1.0, 2.0;
  const VectorXd unit = Eigen::Vector3d(1e9, 1.0, 1e-9);
  return unit.asDiagonal() * A * unit.asDiagonal();
}

TEST(SymmetricSolver, SolvesAcrossUnits) {
  const MatrixXd A = WideScales();
  const SymmetricSolver solver(A);
  ASSERT_TRUE(solver.positive_definite());
  const Eigen::Vector3d x(2e-9, -1.0, 3e9);
  EXPECT_LT((solver.Solve(A * x).col(0).cwiseQuotient(x).array() - 1.0).matrix().norm(), 1e-12);
  EXPECT_LT((A * solver.Inverse() - MatrixXd::Identity(3, 3)).diagonal().norm(), 1e-12);
  EXPECT_NEAR(solver.LogDeterminant(), std::log(16.25), 1e-12);
}

TEST(SymmetricSolver, SaysWhatIsNotPositiveDefinite) {
  Matrix2d A;
  A << 1.0, 2.0, 2.0, 1.0;
  EXPECT_FALSE(SymmetricSolver(A).positive_definite());
  A(0, 0) = std::nan("");
  EXPECT_FALSE(SymmetricSolver(A).positive_definite());
}

TEST(SymmetricSolver, ARidgeHoldsWhatNothingDetermines) {
  Matrix2d A;
  A << 4.0, 0.0, 0.0, 0.0;
  const MatrixXd x = SymmetricSolver(A, kSmallRidge).Solve(Vector2d(2.0, 0.0));
  EXPECT_LT((x - Vector2d(0.5, 0.0)).norm(), 1e-9);
}

TEST(InverseRoot, MakesUnitNoise) {
  const MatrixXd C = WideScales();
  const MatrixXd R = InverseRoot(C);
  EXPECT_LT((R * C * R.transpose() - MatrixXd::Identity(3, 3)).norm(), 1e-12);
  EXPECT_FALSE(InverseRoot(-C).allFinite());
}

TEST(LargestSingularValue, IsTheNormOfTheMap) {
  MatrixXd A(2, 3);
  A << 3.0, 0.0, 0.0, 0.0, 0.0, -5.0;
  EXPECT_NEAR(LargestSingularValue(A), 5.0, 1e-12);
}

TEST(LeastSquares, MinimisesTheResiduals) {
  MatrixXd A(4, 2);
  A << 1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0;
  MatrixXd b(4, 2);
  b << 1.0, 0.0, 3.0, 1.0, 5.0, 0.0, 7.0, 1.0;
  const MatrixXd x = LeastSquares(A, b);
  EXPECT_LT((x.col(0) - Vector2d(1.0, 2.0)).norm(), 1e-12);
  EXPECT_LT((A.transpose() * (A * x - b)).norm(), 1e-12);
}

TEST(LeastSquares, OfManySolutionsTheShortest) {
  MatrixXd A(2, 2);
  A << 1.0, 1.0, 2.0, 2.0;
  EXPECT_LT((LeastSquares(A, Vector2d(2.0, 4.0)) - Vector2d(1.0, 1.0)).norm(), 1e-12);
}

TEST(SpectrumOfSymmetric, IsAscendingAndMakesTheMatrix) {
  Matrix2d m;
  m << 2.0, 1.0, 1.0, 2.0;
  const SymmetricSpectrum s = SpectrumOfSymmetric(m);
  EXPECT_LT((s.values - Vector2d(1.0, 3.0)).norm(), 1e-12);
  EXPECT_LT((s.vectors * s.values.asDiagonal() * s.vectors.transpose() - m).norm(), 1e-12);
}

}  // namespace
}  // namespace camgyro
