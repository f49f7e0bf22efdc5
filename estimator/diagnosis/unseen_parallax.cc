#include "estimator/diagnosis/unseen_parallax.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_view.h"

namespace camgyro {
namespace {

// Of the noise of a match. In `camgyro compare handheld` with points at 50 m (+-10 %), 50 to 150 m
// and 30 to 300 m the gyro's bias is off by 2.8, 1.5 and 0.9 of it (docs/lab/pairs.md).
constexpr double kHiddenShift = 2.0;

// Turn that a pair hides, over its noise [rad/s]; 0 where it says nothing.
double HiddenBy(const PairView& view, const PairPlane& plane) {
  const PairMeasurement& m = view.measurement;
  std::vector<double> shifts, noises;  // along the epipolar lines [rad]
  for (size_t i = 0; i < m.matches.size(); ++i) {
    const Bearing &a = view.bearings.a[i], &b = view.bearings.b[i];
    const double length = b.ray_ref.norm();
    const Eigen::Vector3d ray = b.ray_ref / length;
    const Eigen::Vector3d tau = plane.DirectionOf(m, i);
    const Eigen::Vector3d along = (tau - tau.dot(ray) * ray).normalized();
    shifts.push_back((ray - a.ray_ref.normalized()).dot(along));
    noises.push_back(std::sqrt(
        m.variance_a() * (a.J_ray_px.transpose() * along).squaredNorm() / a.ray_ref.squaredNorm() +
        m.variance_b() * (b.J_ray_px.transpose() * along).squaredNorm() / (length * length)));
  }
  const double noise = MedianInPlace(&noises);
  const double middle = MedianOr(shifts, 0.0);
  for (double& shift : shifts) shift = std::abs(shift - middle);
  const double scatter = kSigmaOfMedian * MedianInPlace(&shifts) / noise;  // with the noise
  return noise / std::max(1.0, scatter * scatter) / (m.frame_b.stamp_s - m.frame_a.stamp_s);
}

}  // namespace

double UnseenParallax(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                      const Calibration& calibration, double noise_px,
                      const PairGraphOptions& options) {
  std::vector<double> hidden(pairs.size(), -1.0);
  ParallelFor(pairs.size(), [&](size_t k) {
    PairView view;
    PairPlane plane;
    if (!ResidualOf(pairs[k], options).facts().has_direction) return;
    if (!FitPair(input, pairs[k], calibration, noise_px, options, &view, &plane)) return;
    hidden[k] = HiddenBy(view, plane);
  });
  hidden.erase(std::remove(hidden.begin(), hidden.end(), -1.0), hidden.end());
  return hidden.empty() ? 0.0 : kHiddenShift * MedianInPlace(&hidden);
}

}  // namespace camgyro
