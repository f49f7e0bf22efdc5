#include "estimator/window/pair_view.h"

#include <glog/logging.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/window/direction_search.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/plane_equations.h"
#include "factors/robust.h"

namespace camgyro {

bool RatesOfPair(const EstimationInput& input, const TimedPair& pair,
                 const Calibration& calibration, std::vector<double>* times_s,
                 Eigen::Matrix3Xd* rates, const Eigen::Vector2d& offsets_s) {
  const auto [from, to] = ExposureSpan(ShutterOf(calibration),
                                       Eigen::Vector2d(calibration.width_px, calibration.height_px),
                                       calibration.pair_effects(), pair.first().Moved(offsets_s[0]),
                                       pair.second().Moved(offsets_s[1]));
  const auto by_time = [](const TimedRate& rate, double t) { return rate.time_s < t; };
  auto first = std::lower_bound(input.rates.begin(), input.rates.end(), from, by_time);
  auto last = std::lower_bound(input.rates.begin(), input.rates.end(), to, by_time);
  if (first == input.rates.begin() || last == input.rates.end()) return false;
  --first;
  ++last;
  const double longest = std::max(0.03, 5.0 * (input.rates.back().time_s - input.rates[0].time_s) /
                                            static_cast<double>(input.rates.size()));
  times_s->clear();
  rates->resize(3, last - first);
  for (auto it = first; it != last; ++it) {
    if (it->saturated) return false;
    if (it != first && it->time_s - std::prev(it)->time_s > longest) return false;
    times_s->push_back(it->time_s);
    Eigen::Vector3d rate = it->omega_gyro_rad_s;
    if (it != input.rates.begin() && std::next(it) != input.rates.end()) {
      const auto before = std::prev(it), after = std::next(it);
      rate = ChainRate(before->omega_gyro_rad_s, rate, after->omega_gyro_rad_s,
                       it->time_s - before->time_s, after->time_s - it->time_s);
    }
    rates->col(it - first) =
        TrueRate(calibration.pair_effects(), it->time_s, rate - calibration.bias_gyro_rad_s);
  }
  return true;
}

BendVector BendSigma(double turn_sigma_rad_s, double readout_s, double gap_s) {
  // A turn that comes and goes with steps of 2.7 Hz.
  constexpr double kStepRadS = 17.0;
  const double turn = turn_sigma_rad_s * std::abs(readout_s);
  BendVector sigma;
  sigma << Eigen::Vector3d::Constant(turn),
      Eigen::Vector3d::Constant(turn * kStepRadS * gap_s / 12.0);
  return sigma.cwiseMax(1e-4);
}

PairPlane PairPlane::TurnedBy(const Eigen::Matrix3d& R_to_from) const {
  PairPlane turned{R_to_from * tau, bend};
  turned.bend.head<3>() = R_to_from * bend.head<3>();
  turned.bend.tail<3>() = R_to_from * bend.tail<3>();
  return turned;
}

Eigen::Vector3d PairPlane::DirectionOf(const PairMeasurement& pair, size_t i) const {
  const Eigen::Vector2d shares = CoplanarityPlane::BendShares(pair, pair.matches[i]);
  return tau + shares[0] * bend.head<3>() + shares[1] * bend.tail<3>();
}

PlaneResidual ResidualOf(const PairView& view, const PairPlane& plane, size_t i) {
  const PairMeasurement& m = view.measurement;
  const Bearing &a = view.bearings.a[i], &b = view.bearings.b[i];
  return EvaluatePlaneResidual(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px,
                               plane.DirectionOf(m, i), m.variance_a(), m.variance_b());
}

double ValueOf(const PairView& view, const PairPlane& plane, size_t i) {
  const PairMeasurement& m = view.measurement;
  const Bearing &a = view.bearings.a[i], &b = view.bearings.b[i];
  return PlaneResidualValue(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px, plane.DirectionOf(m, i),
                            m.variance_a(), m.variance_b());
}

Eigen::Vector2d CorrectionOf(const PairView& view, const PairPlane& plane, size_t i) {
  const Bearing &a = view.bearings.a[i], &b = view.bearings.b[i];
  const Eigen::Vector3d tau = plane.DirectionOf(view.measurement, i);
  // tau . (a x b) = (tau x a) . b moves with px_b, in units of its noise, as this gradient says.
  const Eigen::Vector2d gradient = b.J_ray_px.transpose() * tau.cross(a.ray_ref);
  if (!(gradient.squaredNorm() > 0.0)) return Eigen::Vector2d::Zero();
  return -tau.dot(a.ray_ref.cross(b.ray_ref)) / gradient.squaredNorm() *
         (b.noise_factor * gradient);
}

PairPlane FitPlane(const PairView& view, size_t first, size_t step) {
  const PairMeasurement& m = view.measurement;
  PairPlane plane;
  plane.tau =
      FindDirection(view.bearings, m.variance_a(), m.variance_b(), m.robust_threshold, first, step)
          .tau;
  // A bend is close to linear: a few steps of Gauss-Newton.
  double cost = std::numeric_limits<double>::infinity();
  PairPlane next = plane;
  for (int iteration = 0; iteration < 6; ++iteration) {
    const PlaneEquations equations(view, next, first, step);
    if (!(equations.cost < cost)) break;
    const bool converged = equations.cost > (1.0 - 1e-4) * cost;
    cost = equations.cost;
    plane = next;
    if (converged) break;
    const PlaneEquations::Vector8d change = equations.WithPrior().ldlt().solve(equations.g);
    next.tau = (plane.tau - equations.basis * change.head<2>()).normalized();
    next.bend = plane.bend - change.tail<6>();
  }
  return plane;
}

double DegreesOfFreedom(const PairView& view, const PairPlane& plane, size_t first, size_t step) {
  const PlaneEquations equations(view, plane, first, step);
  return equations.WithPrior().ldlt().solve(equations.data).trace();
}

std::vector<double> PredictedResiduals(const PairView& view, const PairPlane& of_even) {
  const PlaneEquations equations(view, of_even, 0, 2);
  const Eigen::LDLT<PlaneEquations::Matrix8d> information(equations.WithPrior());
  std::vector<double> residuals;
  for (size_t i = 1; i < view.bearings.a.size(); i += 2) {
    const PlaneResidual r = ResidualOf(view, of_even, i);
    const PlaneEquations::Vector8d J = equations.RowOf(view, r, RobustResidual{r.value, 1.0}, i);
    residuals.push_back(r.value / std::sqrt(1.0 + J.dot(information.solve(J))));
  }
  return residuals;
}

namespace {

// All of a view but its matches.
bool SetUp(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
           double noise, const PairGraphOptions& options, const Eigen::Vector2d& offsets_s,
           PairView* view) {
  PairMeasurement& m = view->measurement;
  if (!RatesOfPair(input, pair, calibration, &m.rate_times_s, &view->rates, offsets_s)) {
    return false;
  }
  m.rate_group_sizes = {static_cast<int>(m.rate_times_s.size())};
  m.frame_a = pair.first().Moved(offsets_s[0]);
  m.frame_b = pair.second().Moved(offsets_s[1]);
  m.size_px << calibration.width_px, calibration.height_px;
  m.sigma = noise * pair.noise_factor;
  m.noise = options.match_noise;
  m.robust_threshold = options.robust_threshold;
  m.lens = &GetLens(calibration.distortion_model);
  m.q_a_b = pair.rotation.q_a_b;
  const double gap_s = m.frame_b.stamp_s - m.frame_a.stamp_s;
  const Scan scan =
      ScanOf(ShutterOf(calibration), m.size_px, calibration.pair_effects(), m.frame_a);
  m.scan_shares = scan.shares;
  m.readout_over_gap = scan.readout_s / gap_s;
  view->bend_sigma_rad = BendSigma(
      std::max(options.turn_sigma_rad_s,
               calibration.effects ? calibration.effects->widened_sigma(PairLatent::kTurn) : 0.0),
      scan.readout_s, gap_s);
  m.effects = calibration.pair_effects().set != nullptr ? calibration.effects : nullptr;
  return true;
}

}  // namespace

bool ViewPair(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise, const PairGraphOptions& options, PairView* view,
              const Eigen::Vector2d& offsets_s) {
  if (!SetUp(input, pair, calibration, noise, options, offsets_s, view)) return false;
  PairMeasurement& m = view->measurement;
  m.matches.clear();
  for (auto* bearings : {&view->bearings.a, &view->bearings.b}) {
    bearings->clear();
    bearings->reserve(pair.matches.size());
  }
  for (auto* rays : {&view->rays_a, &view->rays_b}) {
    rays->clear();
    rays->reserve(pair.matches.size());
  }
  const RotationChain chain(m.rate_times_s, view->rates);
  const Eigen::Matrix3d R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  const ShutterParameters shutter = ShutterOf(calibration);
  const auto evaluate = [&](const FrameTime& frame, const Eigen::Vector2d& px, TimedRay* ray) {
    return EvaluateTimedRay(*m.lens, calibration.lens, shutter, frame, m.size_px, px,
                            calibration.pair_effects(), ray);
  };
  TimedRay ray_a, ray_b;
  Bearing a, b;
  for (const Match& match : pair.matches) {
    if (!evaluate(m.frame_a, match.px_a, &ray_a) || !evaluate(m.frame_b, match.px_b, &ray_b)) {
      continue;
    }
    TurnRay(ray_a, 0.0, R_gyro_cam, chain, &a);
    TurnRay(ray_b, 0.0, R_gyro_cam, chain, &b);
    if (!options.residual->HasResidual(*m.lens, calibration.lens, a, b)) continue;
    b.ScaleNoise(match.noise_factor_b);
    m.matches.push_back(match);
    view->rays_a.push_back(ray_a);
    view->rays_b.push_back(ray_b);
    view->bearings.a.push_back(a);
    view->bearings.b.push_back(b);
  }
  return true;
}

bool MoveView(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise, const PairGraphOptions& options, const Eigen::Vector2d& offsets_s,
              PairView* view) {
  CHECK(!options.residual->facts().drops_matches);
  const auto& effects = calibration.effects;
  if (effects != nullptr && effects->follows_own_time()) {
    return ViewPair(input, pair, calibration, noise, options, view, offsets_s);
  }
  const Eigen::Vector2d later_s(offsets_s[0] - view->measurement.frame_a.offset_s,
                                offsets_s[1] - view->measurement.frame_b.offset_s);
  if (!SetUp(input, pair, calibration, noise, options, offsets_s, view)) return false;
  const PairMeasurement& m = view->measurement;
  const RotationChain chain(m.rate_times_s, view->rates);
  const Eigen::Matrix3d R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  for (size_t i = 0; i < m.matches.size(); ++i) {
    view->rays_a[i].time_gyro_s += later_s[0];
    view->rays_b[i].time_gyro_s += later_s[1];
    TurnRay(view->rays_a[i], 0.0, R_gyro_cam, chain, &view->bearings.a[i]);
    TurnRay(view->rays_b[i], 0.0, R_gyro_cam, chain, &view->bearings.b[i]);
    view->bearings.b[i].ScaleNoise(m.matches[i].noise_factor_b);
  }
  return true;
}

}  // namespace camgyro
