#include "estimator/residual_table.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/pair_model.h"
#include "core/rotation_chain.h"
#include "estimator/window/direction_search.h"
#include "factors/coplanarity_plane.h"

namespace camgyro {
namespace {

// Rotations over [from_s, to_s] on the gyro clock; nothing where the gyro does not reach.
std::optional<RotationChain> ChainOver(const EstimationInput& input, double from_s, double to_s,
                                       const Eigen::Vector3d& bias_gyro_rad_s) {
  const auto by_time = [](const TimedRate& rate, double t) { return rate.time_s < t; };
  auto first = std::lower_bound(input.rates.begin(), input.rates.end(), from_s, by_time);
  auto last = std::lower_bound(input.rates.begin(), input.rates.end(), to_s, by_time);
  if (first == input.rates.begin() || last == input.rates.end()) return std::nullopt;
  --first;
  ++last;
  std::vector<double> times;
  Eigen::Matrix3Xd rates(3, last - first);
  for (auto it = first; it != last; ++it) {
    rates.col(it - first) = it->omega_gyro_rad_s - bias_gyro_rad_s;
    times.push_back(it->time_s);
  }
  return RotationChain(times, rates);
}

}  // namespace

std::vector<MatchResidual> ComputeResiduals(const EstimationInput& input,
                                            const std::vector<TimedPair>& pairs,
                                            const Calibration& calibration, double noise_px,
                                            const PairGraphOptions& options) {
  std::vector<MatchResidual> residuals;
  const Lens& lens = GetLens(calibration.distortion_model);
  const ShutterParameters shutter(calibration.delay_s, calibration.readout_s);
  const Eigen::Matrix3d R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  const double variance_b = noise_px * noise_px;
  const double variance_a = options.match_noise == MatchNoise::kBothImages ? variance_b : 0.0;
  for (const TimedPair& pair : pairs) {
    const std::optional<RotationChain> chain =
        ChainOver(input, pair.time_a_s + calibration.delay_s + std::min(0.0, calibration.readout_s),
                  pair.time_b_s + calibration.delay_s + std::max(0.0, calibration.readout_s),
                  calibration.bias_gyro_rad_s);
    if (!chain) continue;
    PairBearings bearings;
    std::vector<MatchResidual> rows;
    for (const Match& match : pair.matches) {
      Bearing a, b;
      if (!EvaluateBearing(lens, calibration.lens, shutter, R_gyro_cam, *chain, pair.time_a_s,
                           calibration.height_px, match.px_a, &a, /*derivatives=*/false) ||
          !EvaluateBearing(lens, calibration.lens, shutter, R_gyro_cam, *chain, pair.time_b_s,
                           calibration.height_px, match.px_b, &b, /*derivatives=*/false)) {
        continue;
      }
      MatchResidual row;
      row.frame_a = pair.frame_a;
      row.frame_b = pair.frame_b;
      row.match = match;
      row.time_s = RowTimeGyroS(pair.time_b_s, shutter, match.px_b.y(), calibration.height_px);
      row.rate_rad_s = b.omega_cam_rad_s.norm();
      rows.push_back(row);
      bearings.a.push_back(a);
      bearings.b.push_back(b);
    }
    if (rows.size() < PairGraph::kMinMatches) continue;
    const Eigen::Vector3d tau =
        FindDirection(bearings, variance_a, variance_b, options.robust_threshold).tau;
    for (size_t i = 0; i < rows.size(); ++i) {
      const Bearing &a = bearings.a[i], &b = bearings.b[i];
      const double sigmas = EvaluatePlaneResidual(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px, tau,
                                                  variance_a, variance_b)
                                .value;
      rows[i].residual_px = sigmas * noise_px;
      rows[i].inlier = std::abs(sigmas) <= options.robust_threshold;
      // tau . (a x b) = (tau x a) . b moves with px_b as this gradient says.
      const Eigen::Vector2d gradient = b.J_ray_px.transpose() * tau.cross(a.ray_ref);
      if (gradient.squaredNorm() > 0.0) {
        rows[i].correction_px =
            -tau.dot(a.ray_ref.cross(b.ray_ref)) / gradient.squaredNorm() * gradient;
      }
    }
    residuals.insert(residuals.end(), rows.begin(), rows.end());
  }
  return residuals;
}

}  // namespace camgyro
