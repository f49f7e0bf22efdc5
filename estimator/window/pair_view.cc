#include "estimator/window/pair_view.h"

#include <glog/logging.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "estimator/window/direction_search.h"
#include "factors/robust.h"
#include "factors/symmetric_transfer.h"

namespace camgyro {

bool RatesOfPair(const EstimationInput& input, const TimedPair& pair,
                 const Calibration& calibration, std::vector<double>* times_s,
                 Eigen::Matrix3Xd* rates) {
  const auto [from, to] = ExposureSpan({calibration.delay_s, calibration.readout_s},
                                       Eigen::Vector2d(calibration.width_px, calibration.height_px),
                                       calibration.pair_effects(), pair.first(), pair.second());
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

double TurnSigma(double turn_sigma_rad_s, double readout_s) {
  return std::max(1e-4, turn_sigma_rad_s * std::abs(readout_s));
}

PlaneResidual ResidualOf(const PairView& view, const PairPlane& plane, size_t i) {
  const PairMeasurement& m = view.measurement;
  const Bearing &a = view.bearings.a[i], &b = view.bearings.b[i];
  const double share = CoplanarityPlane::RowShare(m, m.matches[i]);
  return EvaluatePlaneResidual(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px,
                               plane.tau + share * plane.turn, m.variance_a(), m.variance_b());
}

std::vector<double> TransferResiduals(const PairView& view, const Calibration& calibration) {
  const ShutterParameters shutter(calibration.delay_s, calibration.readout_s);
  const double* const parameters[] = {calibration.lens.data(), shutter.data(),
                                      calibration.q_gyro_cam.coeffs().data(), view.rates.data()};
  std::vector<double> residuals =
      SymmetricTransfer(std::make_shared<const PairMeasurement>(view.measurement))
          .IndependentResiduals(parameters);
  CHECK_EQ(residuals.size(), 2 * view.measurement.matches.size());  // ViewPair kept no others
  return residuals;
}

PairPlane FitPlane(const PairView& view, size_t first, size_t step) {
  const PairMeasurement& m = view.measurement;
  PairBearings some;
  for (size_t i = first; i < m.matches.size(); i += step) {
    some.a.push_back(view.bearings.a[i]);
    some.b.push_back(view.bearings.b[i]);
  }
  PairPlane plane;
  plane.tau = FindDirection(some, m.variance_a(), m.variance_b(), m.robust_threshold).tau;
  // A turn is close to linear: a few steps of Gauss-Newton on
  // two coordinates of the direction and three of the turn.
  using Vector5d = Eigen::Matrix<double, 5, 1>;
  const double prior = 1.0 / (view.turn_sigma_rad * view.turn_sigma_rad);
  double cost = std::numeric_limits<double>::infinity();
  PairPlane next = plane;
  for (int iteration = 0; iteration < 6; ++iteration) {
    Eigen::Matrix<double, 3, 2> basis;
    basis.col(0) = next.tau.unitOrthogonal();
    basis.col(1) = next.tau.cross(basis.col(0));
    Eigen::Matrix<double, 5, 5> H = Eigen::Matrix<double, 5, 5>::Zero();
    Vector5d g = Vector5d::Zero();
    H.diagonal().tail<3>().setConstant(prior);
    g.tail<3>() = prior * next.turn;
    double next_cost = prior * next.turn.squaredNorm();
    for (size_t i = first; i < m.matches.size(); i += step) {
      const PlaneResidual r = ResidualOf(view, next, i);
      const RobustResidual robust = Robustify(r.value, m.robust_threshold);
      const double share = CoplanarityPlane::RowShare(m, m.matches[i]);
      Vector5d J;
      J.head<2>() = robust.derivative * (basis.transpose() * r.by_tau);
      J.tail<3>() = robust.derivative * share * r.by_tau;
      H += J * J.transpose();
      g += J * robust.value;
      next_cost += robust.value * robust.value;
    }
    if (!(next_cost < cost)) break;
    const bool converged = next_cost > (1.0 - 1e-4) * cost;
    cost = next_cost;
    plane = next;
    if (converged) break;
    H.diagonal().head<2>().array() += 1e-12;
    const Vector5d change = H.ldlt().solve(g);
    next.tau = (plane.tau - basis * change.head<2>()).normalized();
    next.turn = plane.turn - change.tail<3>();
  }
  return plane;
}

bool ViewPair(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise_px, const PairGraphOptions& options, PairView* view) {
  PairMeasurement& m = view->measurement;
  if (!RatesOfPair(input, pair, calibration, &m.rate_times_s, &view->rates)) return false;
  m.rate_group_sizes = {static_cast<int>(m.rate_times_s.size())};
  m.frame_a = pair.first();
  m.frame_b = pair.second();
  m.size_px << calibration.width_px, calibration.height_px;
  m.sigma_px = noise_px;
  m.noise = options.match_noise;
  m.robust_threshold = options.robust_threshold;
  m.lens = &GetLens(calibration.distortion_model);
  m.matches.clear();
  view->turn_sigma_rad =
      TurnSigma(std::max(options.turn_sigma_rad_s,
                         calibration.effects ? calibration.effects->turn_sigma_rad_s() : 0.0),
                calibration.readout_s);
  m.effects = calibration.pair_effects().set != nullptr ? calibration.effects : nullptr;
  const RotationChain chain(m.rate_times_s, view->rates);
  const ShutterParameters shutter(calibration.delay_s, calibration.readout_s);
  const Eigen::Matrix3d R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  view->bearings = {};
  Bearing a, b;
  for (const Match& match : pair.matches) {
    if (EvaluateBearing(*m.lens, calibration.lens, shutter, R_gyro_cam, chain, m.frame_a, m.size_px,
                        match.px_a, calibration.pair_effects(), &a) &&
        EvaluateBearing(*m.lens, calibration.lens, shutter, R_gyro_cam, chain, m.frame_b, m.size_px,
                        match.px_b, calibration.pair_effects(), &b) &&
        (options.residual != ResidualKind::kSymmetricTransfer ||
         HasTransfer(*m.lens, calibration.lens, a, b))) {
      b.ScaleNoise(match.noise_factor_b);
      m.matches.push_back(match);
      view->bearings.a.push_back(a);
      view->bearings.b.push_back(b);
    }
  }
  return true;
}

}  // namespace camgyro
