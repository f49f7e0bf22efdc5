// Eigen's decompositions of dense matrices behind plain functions: each is compiled here once, and
// not in every source that needs it, where it takes the compiler some seconds. For small matrices
// of fixed size in inner loops Eigen's own are faster.
#ifndef CAMGYRO_CORE_LINEAR_ALGEBRA_H_
#define CAMGYRO_CORE_LINEAR_ALGEBRA_H_

#include <Eigen/Core>

namespace camgyro {

// e' C^-1 e, the squared Mahalanobis distance of an error e (n, any units) under its covariance C
// (n x n, positive definite). Units may differ by orders of magnitude: C is scaled to correlations.
double SquaredMahalanobis(const Eigen::Ref<const Eigen::VectorXd>& error,
                          const Eigen::Ref<const Eigen::MatrixXd>& covariance);

// x of the least |A x - b| (A: m x n, b: m x k, x: n x k), that of the least norm where A does not
// determine it.
Eigen::MatrixXd LeastSquares(const Eigen::Ref<const Eigen::MatrixXd>& A,
                             const Eigen::Ref<const Eigen::MatrixXd>& b);

struct SymmetricSpectrum {
  Eigen::VectorXd values;   // n, ascending
  Eigen::MatrixXd vectors;  // n x n, orthonormal columns
};

// Eigenvalues and eigenvectors of a symmetric matrix (n x n), of which the lower half is read.
SymmetricSpectrum SpectrumOfSymmetric(const Eigen::Ref<const Eigen::MatrixXd>& symmetric);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_LINEAR_ALGEBRA_H_
