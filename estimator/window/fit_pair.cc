#include "estimator/window/fit_pair.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/window/frame_times.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/plane_equations.h"
#include "factors/robust.h"

namespace camgyro {
namespace {

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

  // A step of Gauss-Newton, with the prior of the times: standard deviations.
  Eigen::Vector2d Step(const Eigen::Vector2d& offsets_s, const Eigen::Vector2d& prior_s) const {
    const Eigen::Vector2d prior = prior_s.cwiseAbs2().cwiseInverse();
    Eigen::Matrix2d H = information;
    H.diagonal() += prior;
    return -H.ldlt().solve(score + prior.cwiseProduct(offsets_s));
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
    const double noise_px = width * noise_px_;
    has_view_ = has_view_
                    ? MoveView(input_, pair_, calibration_, noise_px, options_, offsets_s, &view)
                    : ViewPair(input_, pair_, calibration_, noise_px, options_, &view, offsets_s);
    if (!has_view_ || static_cast<int>(view.measurement.matches.size()) < PairGraph::kMinMatches) {
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
    const double searched_s = std::max(spread_s_, kSearchedSpreadS);
    const double rate = view.rates.colwise().norm().maxCoeff();
    const double width =
        std::max(1.0, kApart * searched_s * rate * calibration_.lens[kFocal] / noise_px_);
    double least = std::numeric_limits<double>::infinity();
    Eigen::Vector2d best = Eigen::Vector2d::Zero();
    for (int a = -2; a <= 2; ++a) {
      for (int b = -2; b <= 2; ++b) {
        const Eigen::Vector2d offsets_s = kApart * searched_s * Eigen::Vector2d(a, b);
        if (!At(offsets_s, width) || !(Cost(width) < least)) continue;
        least = Cost(width);
        best = offsets_s;
      }
    }
    return DescendFrom(best, width);
  }

  // [sigmas^2]
  double Cost(double width = 1.0) const {
    const Eigen::Vector2d offsets_s = OffsetsOf(view);
    return PlaneEquations(view, plane, first_, step_).cost +
           (PriorCost(offsets_s[0], spread_s_) + PriorCost(offsets_s[1], spread_s_)) /
               (width * width);
  }

  double RightShare() const {
    const size_t n = view.bearings.a.size();
    size_t right = 0, all = 0;
    for (size_t i = first_; i < n; i += step_, ++all) {
      right += std::abs(ValueOf(view, plane, i)) <= options_.inlier_sigmas();
    }
    return static_cast<double>(right) / static_cast<double>(all);
  }

  PairView view;
  PairPlane plane;

 private:
  Eigen::Vector2d Step(const Eigen::Vector2d& offsets_s, double width) const {
    const Eigen::Vector2d prior_s(PriorSpread(offsets_s[0], spread_s_),
                                  PriorSpread(offsets_s[1], spread_s_));
    return TimesEquations(view, plane, first_, step_).Step(offsets_s, width * prior_s);
  }

  const EstimationInput& input_;
  const TimedPair& pair_;
  const Calibration& calibration_;
  const double noise_px_;
  const PairGraphOptions& options_;
  const size_t first_, step_;
  const double spread_s_;
  bool has_view_ = false;
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

bool FitPair(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
             double noise_px, const PairGraphOptions& options, PairView* view, PairPlane* plane,
             size_t first, size_t step, const std::optional<Eigen::Vector2d>& times_s) {
  // Where so many of the matches are right, the times are as well: saves time only.
  constexpr double kSurelyRight = 0.9;
  TimesOfPair fit(input, pair, calibration, noise_px, options, first, step);
  if (times_s || !(calibration.pair_effects().frame_time_spread_s() > 0.0)) {
    if (!fit.At(times_s.value_or(Eigen::Vector2d::Zero()))) return false;
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
