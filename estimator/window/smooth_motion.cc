#include "estimator/window/smooth_motion.h"

#include <cmath>

#include "core/linear_algebra.h"
#include "core/robust_statistics.h"

namespace camgyro {
namespace {

constexpr int kHighest = 3;  // degree of the polynomial

// How much of a shift has to lie across the epipolar lines, in variance, to count. Along them it
// may be as large as it likes: a zoom about the epipole has what each point's own error turns of
// its line across it, so that enough of it would explain those errors (2e-6 for 0.4 of 300 px).
constexpr double kLeastSeen = 1e-3;

constexpr int NumTerms(int degree) { return (degree + 1) * (degree + 2) / 2; }

// The highest degree for which there are three equations for each unknown; -1 if for none.
int DegreeFor(Eigen::Index equations, int unknowns_per_term) {
  constexpr int kEquationsPerUnknown = 3;
  int degree = kHighest;
  while (degree >= 0 && equations < kEquationsPerUnknown * unknowns_per_term * NumTerms(degree)) {
    --degree;
  }
  return degree;
}

// The terms of a polynomial at a place (NumTerms(degree)), in picture sizes from the middle.
Eigen::RowVectorXd TermsAt(const Eigen::Vector2d& px, const Eigen::Vector2d& size_px, int degree) {
  const Eigen::Vector2d at = px.cwiseQuotient(size_px) - Eigen::Vector2d(0.5, 0.5);
  Eigen::RowVectorXd terms(NumTerms(degree));
  int term = 0;
  for (int p = 0; p <= degree; ++p) {
    for (int q = 0; p + q <= degree; ++q) terms[term++] = std::pow(at.x(), p) * std::pow(at.y(), q);
  }
  return terms;
}

struct Rest {
  Eigen::MatrixXd values;  // n x k
  double factor = 1.0;     // of their variance, for what was fitted to them
};

// What is left of `values` (n x k) by least squares on A (n x unknowns), each row with a weight of
// Huber: what is near, and wrong matches, pull by their direction. ridge: SymmetricSolver.
Rest RobustRest(const Eigen::MatrixXd& A, const Eigen::MatrixXd& values, double ridge) {
  constexpr int kIterations = 5;
  constexpr double kHuber = 1.5;  // of the scale
  const auto n = static_cast<double>(A.rows());
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(A.rows());
  Rest rest;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Eigen::MatrixXd WA = weights.asDiagonal() * A;
    const Eigen::MatrixXd normal = A.transpose() * WA;
    const SymmetricSolver solver(normal, ridge);
    rest.values = values - A * solver.Solve(WA.transpose() * values);
    rest.factor = n / (n - solver.Solve(normal).trace());
    const Eigen::VectorXd lengths = rest.values.rowwise().norm();
    std::vector<double> sorted(lengths.data(), lengths.data() + lengths.size());
    const double limit = kHuber * MedianInPlace(&sorted);
    weights = (limit * lengths.cwiseMax(1e-9).cwiseInverse()).cwiseMin(1.0);
  }
  return rest;
}

double RobustVariance(const Eigen::VectorXd& values) {
  const Eigen::VectorXd magnitudes = values.cwiseAbs();
  std::vector<double> sorted(magnitudes.data(), magnitudes.data() + magnitudes.size());
  return std::pow(kSigmaOfMedian * MedianInPlace(&sorted), 2);
}

}  // namespace

double UnsmoothVariance(const std::vector<Match>& matches, const Eigen::Vector2d& size_px) {
  const auto n = static_cast<Eigen::Index>(matches.size());
  const int degree = DegreeFor(n, 1);
  if (degree < 0) return -1.0;
  Eigen::MatrixXd A(n, NumTerms(degree));
  Eigen::MatrixXd moved(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Match& match = matches[static_cast<size_t>(i)];
    A.row(i) = TermsAt(match.px_a, size_px, degree);
    moved.row(i) = match.px_b - match.px_a;
  }
  const Rest rest = RobustRest(A, moved, 0.0);
  return rest.factor * (RobustVariance(rest.values.col(0)) + RobustVariance(rest.values.col(1)));
}

std::optional<LeftOver> SeparateSmooth(const std::vector<Eigen::Vector2d>& places_px,
                                       const std::vector<Eigen::Vector2d>& corrections_px,
                                       const Eigen::Vector2d& size_px) {
  const auto n = static_cast<Eigen::Index>(places_px.size());
  const int degree = DegreeFor(n, 2);
  if (degree < 0) return std::nullopt;
  const int terms = NumTerms(degree);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, 2 * terms);
  Eigen::VectorXd lengths = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    if (!corrections_px[k].allFinite() || corrections_px[k].isZero(0.0)) continue;
    lengths[i] = corrections_px[k].norm();
    const Eigen::Vector2d across = corrections_px[k] / lengths[i];
    const Eigen::RowVectorXd at = TermsAt(places_px[k], size_px, degree);
    A.row(i) << across.x() * at, across.y() * at;
  }
  const Rest rest = RobustRest(A, lengths, kLeastSeen);
  return LeftOver{RobustVariance(lengths), rest.factor * RobustVariance(rest.values.col(0))};
}

}  // namespace camgyro
