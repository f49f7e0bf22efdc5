// Eigen's decompositions of dense matrices behind plain functions: each is compiled here once, and
// not in every source that needs it, where it takes the compiler some seconds. For small matrices
// of fixed size in inner loops Eigen's own are faster.
#ifndef CAMGYRO_CORE_LINEAR_ALGEBRA_H_
#define CAMGYRO_CORE_LINEAR_ALGEBRA_H_

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace camgyro {

// e' C^-1 e, the squared Mahalanobis distance of an error e (n, any units) under its covariance C
// (n x n, positive definite). Units may differ by orders of magnitude: C is scaled to correlations.
double SquaredMahalanobis(const Eigen::Ref<const Eigen::VectorXd>& error,
                          const Eigen::Ref<const Eigen::MatrixXd>& covariance);

// A ridge that changes nothing but directions of which a matrix knows nothing: those stay finite.
constexpr double kSmallRidge = 1e-10;

// Solves equations of a symmetric positive semi-definite matrix A (n x n), whose rows may have
// units that differ by orders of magnitude: it is scaled to a unit diagonal before it is
// factorised. `ridge` is added to that diagonal.
class SymmetricSolver {
 public:
  explicit SymmetricSolver(const Eigen::Ref<const Eigen::MatrixXd>& A, double ridge = 0.0);

  bool positive_definite() const;
  Eigen::MatrixXd Solve(const Eigen::Ref<const Eigen::MatrixXd>& b) const;  // n x k
  Eigen::MatrixXd Inverse() const;
  double LogDeterminant() const;  // of a positive definite A

 private:
  Eigen::VectorXd scale_;
  Eigen::LDLT<Eigen::MatrixXd> unit_;
};

// R (n x n) with R' R = C^-1 for a covariance C: it makes unit noise of errors that have this
// covariance. Units may differ by orders of magnitude. Not finite where C is not positive definite.
Eigen::MatrixXd InverseRoot(const Eigen::Ref<const Eigen::MatrixXd>& covariance);

// The largest singular value of A (m x n), which is the norm of A as a map.
double LargestSingularValue(const Eigen::Ref<const Eigen::MatrixXd>& A);

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
