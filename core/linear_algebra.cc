#include "core/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

namespace camgyro {

double SquaredMahalanobis(const Eigen::Ref<const Eigen::VectorXd>& error,
                          const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  return error.dot(SymmetricSolver(covariance).Solve(error).col(0));
}

SymmetricSolver::SymmetricSolver(const Eigen::Ref<const Eigen::MatrixXd>& A, double ridge)
    : scale_(A.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse()) {
  Eigen::MatrixXd unit = scale_.asDiagonal() * A * scale_.asDiagonal();
  unit.diagonal().array() += ridge;
  unit_.compute(unit);
}

bool SymmetricSolver::positive_definite() const {
  return unit_.info() == Eigen::Success && (unit_.vectorD().array() > 0.0).all();
}

Eigen::MatrixXd SymmetricSolver::Solve(const Eigen::Ref<const Eigen::MatrixXd>& b) const {
  return scale_.asDiagonal() * unit_.solve(scale_.asDiagonal() * b);
}

Eigen::MatrixXd SymmetricSolver::Inverse() const {
  return Solve(Eigen::MatrixXd::Identity(scale_.size(), scale_.size()));
}

double SymmetricSolver::LogDeterminant() const {
  return unit_.vectorD().array().log().sum() - 2.0 * scale_.array().log().sum();
}

Eigen::MatrixXd InverseRoot(const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> llt(scale.asDiagonal() * covariance * scale.asDiagonal());
  Eigen::MatrixXd root = scale.asDiagonal();
  if (llt.info() != Eigen::Success) {
    return root.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  llt.matrixL().solveInPlace(root);
  return root;
}

double LargestSingularValue(const Eigen::Ref<const Eigen::MatrixXd>& A) {
  return std::sqrt(std::max(0.0, SpectrumOfSymmetric(A * A.transpose()).values.tail(1)[0]));
}

Eigen::MatrixXd LeastSquares(const Eigen::Ref<const Eigen::MatrixXd>& A,
                             const Eigen::Ref<const Eigen::MatrixXd>& b) {
  return A.completeOrthogonalDecomposition().solve(b);
}

SymmetricSpectrum SpectrumOfSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(symmetric);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

}  // namespace camgyro
