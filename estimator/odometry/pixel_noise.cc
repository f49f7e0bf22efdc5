#include "estimator/odometry/pixel_noise.h"

#include <algorithm>
#include <cmath>

#include "core/robust_statistics.h"

namespace camgyro {
namespace {

// Of fewer sightings a landmark takes most of the noise for itself.
constexpr size_t kLeastSightingsToCorrelate = 5;
// The median length of a unit normal vector in the plane.
constexpr double kMedianLength = 1.177;

}  // namespace

void PixelNoise::Add(const std::vector<Eigen::Vector2d>& residuals_px, bool tracks_drift) {
  for (size_t i = tracks_drift ? 1 : 0; i < residuals_px.size(); ++i) {
    norms_px_.push_back(residuals_px[i].norm());
  }
  if (tracks_drift || residuals_px.size() < kLeastSightingsToCorrelate) return;
  const auto n = static_cast<double>(residuals_px.size());
  for (size_t i = 0; i < residuals_px.size(); ++i) {
    squares_ += residuals_px[i].squaredNorm() / n;
    if (i > 0) products_ += residuals_px[i].dot(residuals_px[i - 1]) / (n - 1.0);
  }
}

double PixelNoise::SigmaPx(double taken) const {
  const double all = 2.0 * static_cast<double>(norms_px_.size());
  return MedianOr(norms_px_, 0.0) / kMedianLength / std::sqrt(std::max(0.1, 1.0 - taken / all));
}

}  // namespace camgyro
