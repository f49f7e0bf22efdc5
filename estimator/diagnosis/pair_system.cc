#include "estimator/diagnosis/pair_system.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/sphere.h"
#include "estimator/window/fit_pair.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_view.h"
#include "factors/rotation_manifold.h"

namespace camgyro {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A factor's residuals and its derivatives by blocks.
struct Evaluated {
  Eigen::VectorXd r;
  std::vector<RowMajor> J;
};

Evaluated Evaluate(const ceres::CostFunction& cost, const std::vector<const double*>& parameters) {
  Evaluated e;
  e.r.resize(cost.num_residuals());
  std::vector<double*> jacobians;
  e.J.reserve(parameters.size());
  for (const int size : cost.parameter_block_sizes()) {
    e.J.emplace_back(cost.num_residuals(), size);
    jacobians.push_back(e.J.back().data());
  }
  if (!cost.Evaluate(parameters.data(), e.r.data(), jacobians.data())) e.r.resize(0);
  return e;
}

// The reading's change by bias and effects, through the rates of a pair.
Eigen::MatrixXd RateColumnsOf(const AllEffects& all, const std::vector<double>& times_s,
                              const Eigen::Matrix3Xd& rates) {
  Eigen::MatrixXd columns(rates.size(), 3 + all.set->size());
  for (Eigen::Index i = 0; i < rates.cols(); ++i) {
    columns.block<3, 3>(3 * i, 0).setIdentity();
    Eigen::Matrix3Xd effects(3, all.set->size());
    all.set->ChangeRate(times_s[static_cast<size_t>(i)], rates.col(i), all.values.data(), effects);
    columns.block(3 * i, 3, 3, effects.cols()) = effects;
  }
  return columns;
}

// A pair's factor with all effects, linearised where the calibration puts it.
struct LinearPair {
  PairView view;
  PairPlane plane;  // of residuals that have a direction
  std::vector<BlockKind> blocks;
  Evaluated factor;

  // By the only block of a kind.
  const RowMajor& J(BlockKind kind) const {
    return factor
        .J[static_cast<size_t>(std::find(blocks.begin(), blocks.end(), kind) - blocks.begin())];
  }
};

// False where the gyro does not cover the pair, or it has too few matches or no value.
bool LinearizePair(const PairResidual& residual, const EstimationInput& input,
                   const TimedPair& pair, const Calibration& c, const AllEffects& all, double noise,
                   const PairGraphOptions& options, const std::optional<Eigen::Vector2d>& times_s,
                   LinearPair* linear) {
  PairView& view = linear->view;
  const bool has_direction = residual.facts().has_direction;
  if (has_direction) {
    if (!FitPair(input, pair, c, noise, options, &view, &linear->plane, 0, 1, times_s)) {
      return false;
    }
  } else if (!ViewPair(input, pair, c, noise, options, &view,
                       times_s.value_or(Eigen::Vector2d::Zero())) ||
             (!residual.facts().of_attitudes &&
              static_cast<int>(view.measurement.matches.size()) < PairGraph::kMinMatches)) {
    return false;
  }
  auto measurement = std::make_shared<PairMeasurement>(view.measurement);
  measurement->effects = all.set->size() > 0 ? all.set : nullptr;
  measurement->own_times =
      residual.facts().with_frame_times && (all.with_times || all.frame_time_spread_s > 0.0);
  const ShutterParameters shutter = ShutterOf(c);
  const double as_in_view = 0.0;  // the measurement's frames have their offsets
  PairParameters at;
  at.own_times = {&as_in_view, &as_in_view};
  at.lens = c.lens.data();
  at.shutter = shutter.data();
  at.q_gyro_cam = c.q_gyro_cam.coeffs().data();
  at.tau = linear->plane.tau.data();
  at.bend = linear->plane.bend.data();
  at.effects = all.values.data();
  at.rates = {view.rates.data()};
  linear->blocks = residual.Blocks(*measurement);
  linear->factor = Evaluate(*residual.MakeCost(measurement, pair.id), at.InOrder(linear->blocks));
  return linear->factor.r.size() > 0;
}

// What state and effects change.
void FillShared(const LinearPair& linear, const Calibration& c, const AllEffects& all,
                PairSystem* s) {
  const bool with_effects = all.set->size() > 0;
  const Eigen::MatrixXd through_rates =
      linear.J(BlockKind::kRates) *
      RateColumnsOf(all, linear.view.measurement.rate_times_s, linear.view.rates);
  s->r = linear.factor.r;
  s->J.setZero(s->r.size(), kStateSize + all.set->size());
  if (std::count(linear.blocks.begin(), linear.blocks.end(), BlockKind::kLens) > 0) {
    s->J.middleCols<3>(kStateFocal) = linear.J(BlockKind::kLens).leftCols<3>();
  }
  s->J.col(kStateReadout) = linear.J(BlockKind::kShutter).col(kReadout);
  s->J.col(kStateDelay) = linear.J(BlockKind::kShutter).col(kDelay);
  s->J.middleCols<3>(kStateBias) = -through_rates.leftCols<3>();
  RotationManifold manifold;
  Eigen::Matrix<double, 4, 3, Eigen::RowMajor> plus;
  manifold.PlusJacobian(c.q_gyro_cam.coeffs().data(), plus.data());
  s->J.middleCols<3>(kStateRotation) = linear.J(BlockKind::kRotation) * plus;
  s->J.rightCols(all.set->size()) = -through_rates.rightCols(all.set->size());
  if (with_effects) s->J.rightCols(all.set->size()) += linear.J(BlockKind::kEffects);
  const auto times = std::find(linear.blocks.begin(), linear.blocks.end(), BlockKind::kFrameTime);
  if (times == linear.blocks.end()) return;
  const auto first = static_cast<size_t>(times - linear.blocks.begin());
  s->by_times.resize(s->r.size(), 2);
  s->by_times << linear.factor.J[first], linear.factor.J[first + 1];
}

// What is the pair's own: direction, bend, the frames' times, and noise of the rates as PairGraph
// has it, its means over some samples (of attitudes: each).
void FillOwn(const PairResidual& residual, const LinearPair& linear, const TimedPair& pair,
             const Calibration& c, const AllEffects& all, const PairGraphOptions& options,
             PairSystem* s) {
  const PairMeasurement& m = linear.view.measurement;
  const RowMajor& by_rates = linear.J(BlockKind::kRates);
  const Eigen::Index samples = linear.view.rates.cols();
  const double interval_s = (m.rate_times_s.back() - m.rate_times_s.front()) / (samples - 1.0);
  const Eigen::Index step =
      residual.facts().of_attitudes ? 1 : options.RateStep(interval_s, c.lens[kFocal]);
  const Eigen::Index values = (samples + step - 1) / step;
  const Eigen::Index of_direction = residual.facts().has_direction ? 8 : 0;
  const bool with_times = all.frame_time_spread_s > 0.0 && s->by_times.cols() > 0;
  const Eigen::Index own = of_direction + (with_times ? 2 : 0);
  s->first_of_gyro = own;
  s->N.setZero(s->r.size(), own + 3 * values);
  s->prior.setZero(s->N.cols());
  s->at.setZero(s->N.cols());
  if (of_direction > 0) {
    s->N.leftCols<2>() = linear.J(BlockKind::kDirection) * TangentsOf(linear.plane.tau);
    s->N.middleCols<6>(2) = linear.J(BlockKind::kBend);
    s->prior.segment<6>(2) = linear.view.bend_sigma_rad.cwiseAbs2().cwiseInverse();
    s->at.segment<6>(2) = linear.plane.bend;
  }
  if (with_times) {
    s->times_column = static_cast<int>(of_direction);
    s->N.middleCols<2>(of_direction) = s->by_times;
    s->prior.segment<2>(of_direction)
        << std::pow(PriorSpread(m.frame_a.offset_s, all.frame_time_spread_s), -2.0),
        std::pow(PriorSpread(m.frame_b.offset_s, all.frame_time_spread_s), -2.0);
    s->at.segment<2>(of_direction) << m.frame_a.offset_s, m.frame_b.offset_s;
  }
  for (Eigen::Index k = 0; k < values; ++k) {
    const Eigen::Index count = std::min(step, samples - k * step);
    for (Eigen::Index i = k * step; i < k * step + count; ++i) {
      s->N.middleCols<3>(own + 3 * k) += by_rates.middleCols<3>(3 * i);
    }
    s->prior.segment<3>(own + 3 * k) =
        static_cast<double>(count) * options.gyro_sigma_rad_s.cwiseAbs2().cwiseInverse();
  }
  if (of_direction > 0 && all.free_turn_rad_s > 0.0) {
    s->bend_column = 2;
    const Scan scan = ScanOf(ShutterOf(c), m.size_px, c.pair_effects(), m.frame_a);
    s->free_bend = BendSigma(all.free_turn_rad_s, scan.readout_s, pair.time_b_s - pair.time_a_s)
                       .cwiseAbs2()
                       .cwiseInverse();
  }
}

}  // namespace

AllEffects AllEffectsOf(const Calibration& calibration, const EffectSet* candidates) {
  auto set = std::make_shared<EffectSet>();
  if (calibration.effects) {
    for (const auto& item : calibration.effects->items()) {
      set->Add(item);
    }
  }
  const int present = set->size();
  if (candidates != nullptr) {
    for (const auto& item : candidates->items()) set->Add(item);
  }
  AllEffects all;
  if (candidates != nullptr) all.free_turn_rad_s = candidates->widened_sigma(PairLatent::kTurn);
  all.values = Eigen::VectorXd::Zero(set->size());
  if (present > 0) all.values.head(present) = calibration.effect_values;
  all.frame_time_spread_s = calibration.pair_effects().frame_time_spread_s();
  all.set = set;
  return all;
}

bool MakePairSystem(const EstimationInput& input, const TimedPair& pair,
                    const Calibration& calibration, const AllEffects& all, double noise,
                    const PairGraphOptions& options, PairSystem* system,
                    const std::optional<Eigen::Vector2d>& times_s) {
  const PairResidual& residual = ResidualOf(pair, options);
  LinearPair linear;
  if (!LinearizePair(residual, input, pair, calibration, all, noise, options, times_s, &linear)) {
    return false;
  }
  FillShared(linear, calibration, all, system);
  FillOwn(residual, linear, pair, calibration, all, options, system);
  return true;
}

}  // namespace camgyro
