#include "estimator/window/pair_view.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/sphere.h"
#include "estimator/window/direction_search.h"
#include "estimator/window/pair_graph.h"
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

Eigen::Vector2d CorrectionOf(const PairView& view, const PairPlane& plane, size_t i) {
  const Bearing &a = view.bearings.a[i], &b = view.bearings.b[i];
  const Eigen::Vector3d tau = plane.DirectionOf(view.measurement, i);
  // tau . (a x b) = (tau x a) . b moves with px_b, in units of its noise, as this gradient says.
  const Eigen::Vector2d gradient = b.J_ray_px.transpose() * tau.cross(a.ray_ref);
  if (!(gradient.squaredNorm() > 0.0)) return Eigen::Vector2d::Zero();
  return -tau.dot(a.ray_ref.cross(b.ray_ref)) / gradient.squaredNorm() *
         (b.noise_factor * gradient);
}

namespace {

// Normal equations of some matches, about a plane: two coordinates of the direction, then the bend.
struct PlaneEquations {
  using Matrix8d = Eigen::Matrix<double, 8, 8>;
  using Vector8d = Eigen::Matrix<double, 8, 1>;

  PlaneEquations(const PairView& view, const PairPlane& plane, size_t first, size_t step)
      : basis(TangentsOf(plane.tau)) {
    const PairMeasurement& m = view.measurement;
    prior.tail<6>() = view.bend_sigma_rad.cwiseAbs2().cwiseInverse();
    g.tail<6>() = prior.tail<6>().cwiseProduct(plane.bend);
    cost = plane.bend.dot(g.tail<6>());
    for (size_t i = first; i < m.matches.size(); i += step) {
      const PlaneResidual r = ResidualOf(view, plane, i);
      const RobustResidual robust = Robustify(r.value, m.robust_threshold);
      const Vector8d J = RowOf(view, r, robust, i);
      data += J * J.transpose();
      g += J * robust.value;
      cost += robust.value * robust.value;
    }
  }
  Vector8d RowOf(const PairView& view, const PlaneResidual& r, const RobustResidual& robust,
                 size_t i) const {
    const PairMeasurement& m = view.measurement;
    const Eigen::Vector2d shares = CoplanarityPlane::BendShares(m, m.matches[i]);
    Vector8d J;
    J.head<2>() = robust.derivative * (basis.transpose() * r.by_tau);
    J.segment<3>(2) = robust.derivative * shares[0] * r.by_tau;
    J.tail<3>() = robust.derivative * shares[1] * r.by_tau;
    return J;
  }
  Matrix8d WithPrior() const {
    Matrix8d H = data;
    H.diagonal() += prior;
    H.diagonal().array() += 1e-9;  // a direction that nothing determines
    return H;
  }

  Eigen::Matrix<double, 3, 2> basis;
  Matrix8d data = Matrix8d::Zero();
  Vector8d prior = Vector8d::Zero(), g = Vector8d::Zero();
  double cost = 0.0;
};

// What the matches first, first + step, ... say of the two frames' times, about those of the view,
// direction and bend free beside them: half of chi2's gradient [1/s], and its curvature [1/s^2].
struct TimesEquations {
  TimesEquations(const PairView& view, const PairPlane& plane, size_t first, size_t step) {
    const PairMeasurement& m = view.measurement;
    const PlaneEquations equations(view, plane, first, step);
    Eigen::Matrix<double, 8, 2> mixed = Eigen::Matrix<double, 8, 2>::Zero();
    for (size_t i = first; i < m.matches.size(); i += step) {
      const PlaneResidual r = ResidualOf(view, plane, i);
      const RobustResidual robust = Robustify(r.value, m.robust_threshold);
      const Eigen::Vector2d by_times =
          robust.derivative * Eigen::Vector2d(ByTime(view.bearings.a[i], r.by_a, r.by_J_a),
                                              ByTime(view.bearings.b[i], r.by_b, r.by_J_b));
      mixed += equations.RowOf(view, r, robust, i) * by_times.transpose();
      information += by_times * by_times.transpose();
      score += robust.value * by_times;
    }
    const Eigen::LDLT<PlaneEquations::Matrix8d> rest(equations.WithPrior());
    information -= mixed.transpose() * rest.solve(mixed);
    score -= mixed.transpose() * rest.solve(equations.g);
  }

  // A step of Gauss-Newton, with the prior of the times.
  Eigen::Vector2d Step(const Eigen::Vector2d& offsets_s, double spread_s) const {
    const double prior = 1.0 / (spread_s * spread_s);
    const Eigen::Matrix2d H = information + prior * Eigen::Matrix2d::Identity();
    return -H.ldlt().solve(score + prior * offsets_s);
  }

  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d score = Eigen::Vector2d::Zero();
};

Eigen::Vector2d OffsetsOf(const PairView& view) {
  return {view.measurement.frame_a.offset_s, view.measurement.frame_b.offset_s};
}

// The plane of a pair's matches first, first + step, ..., at times of its frames' own.
class TimesOfPair {
 public:
  TimesOfPair(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise_px, const PairGraphOptions& options, size_t first, size_t step)
      : input_(input),
        pair_(pair),
        calibration_(calibration),
        noise_px_(noise_px),
        options_(options),
        first_(first),
        step_(step),
        spread_s_(calibration.pair_effects().frame_time_spread_s()) {}

  // With these times, held. width: how many times larger than it is the noise is taken for.
  bool At(const Eigen::Vector2d& offsets_s, double width = 1.0) {
    if (!ViewPair(input_, pair_, calibration_, width * noise_px_, options_, &view, offsets_s) ||
        static_cast<int>(view.measurement.matches.size()) < PairGraph::kMinMatches) {
      return false;
    }
    plane = FitPlane(view, first_, step_);
    return true;
  }

  // From these times down to the nearest minimum; with a width, from noise that is so much larger.
  bool DescendFrom(Eigen::Vector2d offsets_s, double width = 1.0) {
    constexpr int kStepsAtWidth = 2, kMostSteps = 6;
    constexpr double kConvergedS = 2e-6;  // turns by some 1e-6 rad
    for (; width > 1.0; width *= 0.5) {
      for (int i = 0; i < kStepsAtWidth; ++i) {
        if (!At(offsets_s, width)) return false;
        offsets_s += Step(offsets_s, width);
      }
    }
    for (int i = 0; At(offsets_s); ++i) {
      const Eigen::Vector2d change = Step(offsets_s, 1.0);
      if (i == kMostSteps || !(change.norm() > kConvergedS)) return true;
      offsets_s += change;
    }
    return false;
  }

  // Over the times that are likely, with noise so large that none of their right matches is beyond
  // the loss in between, and down from the best. Frames that are very late would not be heard else:
  // a direction across the rotation fits most of what a wrong time does to the matches.
  bool Search() {
    constexpr double kApart = 1.25;  // [spreads]; two of them to either side (FitPair's test)
    if (!At(Eigen::Vector2d::Zero())) return false;
    const double rate = view.rates.colwise().norm().maxCoeff();
    const double width =
        std::max(1.0, kApart * spread_s_ * rate * calibration_.lens[kFocal] / noise_px_);
    double least = std::numeric_limits<double>::infinity();
    Eigen::Vector2d best = Eigen::Vector2d::Zero();
    for (int a = -2; a <= 2; ++a) {
      for (int b = -2; b <= 2; ++b) {
        const Eigen::Vector2d offsets_s = kApart * spread_s_ * Eigen::Vector2d(a, b);
        if (!At(offsets_s, width) || !(Cost(width) < least)) continue;
        least = Cost(width);
        best = offsets_s;
      }
    }
    return DescendFrom(best, width);
  }

  // [sigmas^2]
  double Cost(double width = 1.0) const {
    return PlaneEquations(view, plane, first_, step_).cost +
           OffsetsOf(view).squaredNorm() / std::pow(width * spread_s_, 2);
  }

  double RightShare() const {
    const size_t n = view.bearings.a.size();
    size_t right = 0, all = 0;
    for (size_t i = first_; i < n; i += step_, ++all) {
      right += std::abs(ResidualOf(view, plane, i).value) <= options_.inlier_sigmas();
    }
    return static_cast<double>(right) / static_cast<double>(all);
  }

  PairView view;
  PairPlane plane;

 private:
  Eigen::Vector2d Step(const Eigen::Vector2d& offsets_s, double width) const {
    return TimesEquations(view, plane, first_, step_).Step(offsets_s, width * spread_s_);
  }

  const EstimationInput& input_;
  const TimedPair& pair_;
  const Calibration& calibration_;
  const double noise_px_;
  const PairGraphOptions& options_;
  const size_t first_, step_;
  const double spread_s_;
};

// A pair with enough of its matches first, first + step, ... to search times by.
TimedPair WithFewMatches(const TimedPair& pair, size_t first, size_t step) {
  constexpr size_t kEnough = 40;
  TimedPair few = pair;
  few.matches.clear();
  const size_t thinner = step * std::max<size_t>(1, pair.matches.size() / (step * kEnough));
  for (size_t i = first; i < pair.matches.size(); i += thinner) {
    few.matches.push_back(pair.matches[i]);
  }
  return few;
}

}  // namespace

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

bool ViewPair(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise, const PairGraphOptions& options, PairView* view,
              const Eigen::Vector2d& offsets_s) {
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
  m.matches.clear();
  m.q_a_b = pair.rotation.q_a_b;
  const double gap_s = m.frame_b.stamp_s - m.frame_a.stamp_s;
  const ShutterParameters shutter = ShutterOf(calibration);
  const Scan scan = ScanOf(shutter, m.size_px, calibration.pair_effects(), m.frame_a);
  m.scan_shares = scan.shares;
  m.readout_over_gap = scan.readout_s / gap_s;
  view->bend_sigma_rad = BendSigma(
      std::max(options.turn_sigma_rad_s,
               calibration.effects ? calibration.effects->widened_sigma(PairLatent::kTurn) : 0.0),
      scan.readout_s, gap_s);
  m.effects = calibration.pair_effects().set != nullptr ? calibration.effects : nullptr;
  const RotationChain chain(m.rate_times_s, view->rates);
  const Eigen::Matrix3d R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  view->bearings = {};
  Bearing a, b;
  for (const Match& match : pair.matches) {
    if (EvaluateBearing(*m.lens, calibration.lens, shutter, R_gyro_cam, chain, m.frame_a, m.size_px,
                        match.px_a, calibration.pair_effects(), &a) &&
        EvaluateBearing(*m.lens, calibration.lens, shutter, R_gyro_cam, chain, m.frame_b, m.size_px,
                        match.px_b, calibration.pair_effects(), &b) &&
        options.residual->HasResidual(*m.lens, calibration.lens, a, b)) {
      b.ScaleNoise(match.noise_factor_b);
      m.matches.push_back(match);
      view->bearings.a.push_back(a);
      view->bearings.b.push_back(b);
    }
  }
  return true;
}

bool FitPair(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
             double noise_px, const PairGraphOptions& options, PairView* view, PairPlane* plane,
             size_t first, size_t step) {
  // Where so many of the matches are right, the times are as well: saves time only.
  constexpr double kSurelyRight = 0.9;
  TimesOfPair fit(input, pair, calibration, noise_px, options, first, step);
  if (!(calibration.pair_effects().frame_time_spread_s() > 0.0)) {
    if (!fit.At(Eigen::Vector2d::Zero())) return false;
  } else if (!fit.DescendFrom(Eigen::Vector2d::Zero())) {
    return false;
  } else if (fit.RightShare() < kSurelyRight) {
    const TimedPair few = WithFewMatches(pair, first, step);
    TimesOfPair coarse(input, few, calibration, noise_px, options, 0, 1);
    TimesOfPair other = fit;
    if (coarse.Search() && other.DescendFrom(OffsetsOf(coarse.view)) && other.Cost() < fit.Cost()) {
      fit.view = std::move(other.view);
      fit.plane = other.plane;
    }
  }
  *view = std::move(fit.view);
  *plane = fit.plane;
  return true;
}

bool TimesOfPairAlone(const EstimationInput& input, const TimedPair& pair,
                      const Calibration& calibration, double noise_px,
                      const PairGraphOptions& options, PairTimes* times) {
  PairView view;
  PairPlane plane;
  if (!FitPair(input, pair, calibration, noise_px, options, &view, &plane)) return false;
  const TimesEquations equations(view, plane, 0, 1);
  times->frame_a = PairGraph::FrameNumber(pair.time_a_s);
  times->frame_b = PairGraph::FrameNumber(pair.time_b_s);
  times->information = equations.information;
  times->score = equations.score - equations.information * OffsetsOf(view);
  return true;
}

}  // namespace camgyro
