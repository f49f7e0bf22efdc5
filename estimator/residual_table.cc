#include "estimator/residual_table.h"

#include <cmath>

#include "estimator/window/pair_view.h"

namespace camgyro {
namespace {

// Median of the magnitude of a Gaussian by that of the length of two.
constexpr double kMedianOfOne = 0.67449 / 1.17741;

}  // namespace

std::vector<MatchResidual> ComputeResiduals(const EstimationInput& input,
                                            const std::vector<TimedPair>& pairs,
                                            const Calibration& calibration, double noise_px,
                                            const PairGraphOptions& options) {
  std::vector<MatchResidual> residuals;
  const ShutterParameters shutter = ShutterOf(calibration);
  PairView view;
  for (const TimedPair& pair : pairs) {
    const bool transfer = options.residual == ResidualKind::kSymmetricTransfer;
    PairPlane plane;
    if (!(transfer ? ViewPair(input, pair, calibration, noise_px, options, &view)
                   : FitPair(input, pair, calibration, noise_px, options, &view, &plane))) {
      continue;
    }
    const PairBearings& bearings = view.bearings;
    if (bearings.a.size() < PairGraph::kMinMatches) continue;
    const std::vector<double> transfers =
        transfer ? TransferResiduals(view, calibration) : std::vector<double>();
    const double sigma_of_two_px =
        std::sqrt(view.measurement.variance_a() + view.measurement.variance_b());
    for (size_t i = 0; i < bearings.a.size(); ++i) {
      const Bearing &a = bearings.a[i], &b = bearings.b[i];
      MatchResidual row;
      row.frame_a = pair.frame_a;
      row.frame_b = pair.frame_b;
      row.match = view.measurement.matches[i];
      row.time_s = RowTimeGyroS(pair.time_b_s, shutter, row.match.px_b.y(), calibration.height_px);
      row.rate_rad_s = b.omega_cam_rad_s.norm();
      if (transfer) {
        const Eigen::Vector2d two(transfers[2 * i], transfers[2 * i + 1]);
        row.residual_px = kMedianOfOne * two.norm() * noise_px;
        row.correction_px = -sigma_of_two_px * two;
        row.inlier = two.norm() <= options.inlier_sigmas();
        residuals.push_back(row);
        continue;
      }
      const double sigmas = ResidualOf(view, plane, i).value;
      const Eigen::Vector3d tau = plane.DirectionOf(view.measurement, i);
      row.residual_px = sigmas * noise_px;
      row.inlier = std::abs(sigmas) <= options.inlier_sigmas();
      // tau . (a x b) = (tau x a) . b moves with px_b, in units of its noise, as this gradient
      // says.
      const Eigen::Vector2d gradient = b.J_ray_px.transpose() * tau.cross(a.ray_ref);
      if (gradient.squaredNorm() > 0.0) {
        row.correction_px = -tau.dot(a.ray_ref.cross(b.ray_ref)) / gradient.squaredNorm() *
                            (b.noise_factor * gradient);
      }
      residuals.push_back(row);
    }
  }
  return residuals;
}

}  // namespace camgyro
