#include "estimator/start/scan_curve.h"

#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"

namespace camgyro {
namespace {

constexpr double kTruncateSigmas = 3.0;  // of the norm of two axes

// Parabola y = c0 + c1 x + c2 x^2 through points (least squares); rows of coefficients per column
// of y.
Eigen::MatrixXd FitParabola(const Eigen::VectorXd& x, const Eigen::MatrixXd& y) {
  Eigen::MatrixXd powers(x.size(), 3);
  powers << Eigen::VectorXd::Ones(x.size()), x, x.cwiseAbs2();
  return LeastSquares(powers, y);
}

}  // namespace

ScanCurve::ScanCurve(std::vector<ScanPoint> points, double spacing, double means_of)
    : points_(std::move(points)), spacing_(spacing), means_of_(means_of) {
  std::sort(points_.begin(), points_.end(),
            [](const ScanPoint& a, const ScanPoint& b) { return a.x < b.x; });
  Truncate();
}

const ScanPoint& ScanCurve::Best() const {
  return *std::min_element(
      points_.begin(), points_.end(),
      [](const ScanPoint& a, const ScanPoint& b) { return a.loss.sum() < b.loss.sum(); });
}

double ScanCurve::RunnerUpRatio(double distance) const {
  const ScanPoint& best = Best();
  double second = -1.0;
  for (const ScanPoint& point : points_) {
    if (std::abs(point.x - best.x) <= distance) continue;
    if (second < 0.0 || point.loss.sum() < second) second = point.loss.sum();
  }
  return second > 0.0 ? best.loss.sum() / second : 1.0;
}

std::pair<double, double> ScanCurve::Minimum() const {
  const ScanPoint& best = Best();
  std::vector<const ScanPoint*> close;
  for (const ScanPoint& point : points_) {
    if (std::abs(point.x - best.x) < 1.1 * spacing_) close.push_back(&point);
  }
  Eigen::VectorXd x(static_cast<Eigen::Index>(close.size()));
  Eigen::MatrixXd y(static_cast<Eigen::Index>(close.size()), kScanBlocks);
  for (size_t k = 0; k < close.size(); ++k) {
    x[static_cast<Eigen::Index>(k)] = close[k]->x - best.x;
    y.row(static_cast<Eigen::Index>(k)) = close[k]->loss.transpose();
  }
  const Eigen::MatrixXd parabolas = FitParabola(x, y);
  const Eigen::Vector3d sum = parabolas.rowwise().sum();
  const bool inside = &best != &points_.front() && &best != &points_.back();
  if (!inside || !(sum[2] > 0.0)) return {best.x, 1.0};
  const double shift = std::clamp(-0.5 * sum[1] / sum[2], -spacing_, spacing_);
  const double classical = noise_ * noise_ / (means_of_ * sum[2]);
  const double scores = (parabolas.row(1) + 2.0 * shift * parabolas.row(2)).squaredNorm() *
                        kScanBlocks / (kScanBlocks - 1.0);
  const double sandwich = scores / (4.0 * sum[2] * sum[2]);
  return {best.x + shift, std::min(1.0, std::sqrt(std::max(classical, sandwich)))};
}

void ScanCurve::Truncate() {
  size_t pairs = 1;  // with a rotation, at the point that has most
  for (const ScanPoint& point : points_) {
    if (point.squares.empty()) continue;
    if (noise_ < 0.0 || point.noise < noise_) noise_ = point.noise;
    pairs = std::max(pairs, point.squares.size());
    gyro_power_ = std::max(gyro_power_, point.gyro_power);
  }
  const double cap = 2.0 * std::pow(kTruncateSigmas * noise_, 2);
  for (ScanPoint& point : points_) {
    point.loss = Eigen::VectorXd::Zero(kScanBlocks);
    for (size_t i = 0; i < point.squares.size(); ++i) {
      point.loss[point.blocks[i]] += std::min(point.squares[i], cap);
    }
    // A pair that found no rotation at this point counts as an outlier.
    point.loss.array() += cap * static_cast<double>(pairs - point.squares.size()) / kScanBlocks;
  }
}

}  // namespace camgyro
