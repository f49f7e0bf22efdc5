#include "estimator/diagnosis/pair_scores.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/window/pair_view.h"
#include "factors/coplanarity_plane.h"
#include "factors/relative_rotation.h"
#include "factors/rotation_manifold.h"

namespace camgyro {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The model's effects and the candidates side by side; candidates at zero.
struct AllEffects {
  std::shared_ptr<const EffectSet> set;
  Eigen::VectorXd values;
  double free_turn_rad_s = 0.0;  // what candidates widen the prior of the turn to; 0: none does
};

AllEffects Join(const Calibration& calibration, const EffectSet* candidates) {
  auto set = std::make_shared<EffectSet>();
  if (calibration.effects) {
    for (const auto& item : calibration.effects->items()) {
      set->Add(item.entry, item.shape, item.effect);
    }
  }
  const int present = set->size();
  if (candidates != nullptr) {
    for (const auto& item : candidates->items()) set->Add(item.entry, item.shape, item.effect);
  }
  AllEffects all;
  if (candidates != nullptr) all.free_turn_rad_s = candidates->widened_sigma(PairLatent::kTurn);
  all.values = Eigen::VectorXd::Zero(set->size());
  if (present > 0) all.values.head(present) = calibration.effect_values;
  all.set = set;
  return all;
}

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
    all.set->ChangeRate(times_s[static_cast<size_t>(i)], rates.col(i), effects);
    columns.block(3 * i, 3, 3, effects.cols()) = effects;
  }
  return columns;
}

// r and J (state, effects) of one pair with the pair's own columns N, which have precisions P.
struct PairSystem {
  Eigen::VectorXd r;
  Eigen::MatrixXd J, N;
  Eigen::VectorXd prior;  // of N's columns, 1 / sigma^2, around zero
  Eigen::VectorXd at;     // where they are
  int bend_column = -1;   // of N, where a candidate frees the bend; -1: none does
  BendVector free_bend;   // 1 / sigma^2 of a bend that is free
};

void ProjectInto(const PairSystem& s, int num_model, PairScore* pair, BlockScore* block) {
  Eigen::MatrixXd A = s.N.transpose() * s.N;
  A.diagonal() += s.prior;
  A.diagonal().array() += 1e-9;
  const Eigen::LDLT<Eigen::MatrixXd> solver(A);
  const Eigen::MatrixXd NJ = s.N.transpose() * s.J;
  const Eigen::VectorXd Nr = s.N.transpose() * s.r + s.prior.cwiseProduct(s.at);
  const Eigen::MatrixXd X = solver.solve(NJ);
  const Eigen::VectorXd x = solver.solve(Nr);
  const Eigen::VectorXd g = s.J.transpose() * s.r - NJ.transpose() * x;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(s.J.cols(), s.J.cols());
  H.selfadjointView<Eigen::Lower>().rankUpdate(s.J.transpose());
  H.triangularView<Eigen::StrictlyUpper>() = H.transpose();
  H.noalias() -= NJ.transpose() * X;
  pair->chi2 = s.r.squaredNorm() + s.at.dot(s.prior.cwiseProduct(s.at)) - Nr.dot(x);
  pair->g = g;
  pair->H = H.topLeftCorner(num_model, num_model);
  block->g += g;
  block->H += H;
  block->chi2 += pair->chi2;
  block->residuals += pair->residuals;
  ++block->pairs;
  if (s.bend_column < 0) return;

  // Likelihood of two widths of the bend, all else of the pair projected out: with u the bend's
  // score and W its information, 2 log L(s) = u (W + s^-2)^-1 u - log det(1 + s^2 W).
  const Eigen::Index at = s.bend_column, n = s.N.cols();
  Eigen::VectorXd wide = s.prior;
  wide.segment<6>(at) = s.free_bend;
  const auto two_log = [&](const Eigen::VectorXd& prior) {
    Eigen::MatrixXd B = s.N.transpose() * s.N;
    B.diagonal() += prior;
    B.diagonal().array() += 1e-9;
    const Eigen::LDLT<Eigen::MatrixXd> factor(B);
    double log_det = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) log_det += std::log(factor.vectorD()[i]);
    const Eigen::VectorXd b = s.N.transpose() * s.r + prior.cwiseProduct(s.at);
    return b.dot(factor.solve(b)) - s.at.dot(prior.cwiseProduct(s.at)) - log_det +
           prior.segment<6>(at).array().log().sum();
  };
  pair->latent_gain = two_log(wide) - two_log(s.prior);
}

bool PixelSystem(const EstimationInput& input, const TimedPair& pair, const Calibration& c,
                 const AllEffects& all, double noise, const PairGraphOptions& options,
                 PairSystem* s) {
  PairView view;
  if (!ViewPair(input, pair, c, noise, options, &view) ||
      static_cast<int>(view.measurement.matches.size()) < PairGraph::kMinMatches) {
    return false;
  }
  const PairPlane plane = FitPlane(view);
  auto measurement = std::make_shared<PairMeasurement>(view.measurement);
  measurement->effects = all.set->size() > 0 ? all.set : nullptr;
  const CoplanarityPlane cost(measurement);
  const ShutterParameters shutter = ShutterOf(c);
  std::vector<const double*> parameters = {c.lens.data(), shutter.data(),
                                           c.q_gyro_cam.coeffs().data(), plane.tau.data(),
                                           plane.bend.data()};
  if (measurement->effects) parameters.push_back(all.values.data());
  parameters.push_back(view.rates.data());
  const Evaluated e = Evaluate(cost, parameters);
  if (e.r.size() == 0) return false;

  const RowMajor& by_rates = e.J.back();
  const Eigen::MatrixXd through_rates =
      by_rates * RateColumnsOf(all, measurement->rate_times_s, view.rates);
  s->r = e.r;
  s->J.resize(e.r.size(), kStateSize + all.set->size());
  s->J.middleCols<3>(kStateFocal) = e.J[0].leftCols<3>();
  s->J.col(kStateReadout) = e.J[1].col(kReadout);
  s->J.col(kStateDelay) = e.J[1].col(kDelay);
  s->J.middleCols<3>(kStateBias) = -through_rates.leftCols<3>();
  RotationManifold manifold;
  Eigen::Matrix<double, 4, 3, Eigen::RowMajor> plus;
  manifold.PlusJacobian(c.q_gyro_cam.coeffs().data(), plus.data());
  s->J.middleCols<3>(kStateRotation) = e.J[2] * plus;
  s->J.rightCols(all.set->size()) = -through_rates.rightCols(all.set->size());
  if (measurement->effects) s->J.rightCols(all.set->size()) += e.J[CoplanarityPlane::kEffectsBlock];

  const Eigen::Vector3d u = plane.tau.unitOrthogonal(), v = plane.tau.cross(u);
  // The noise of the rates as PairGraph has it: its means over some samples.
  const Eigen::Index samples = view.rates.cols();
  const double interval_s =
      (measurement->rate_times_s.back() - measurement->rate_times_s.front()) / (samples - 1.0);
  const Eigen::Index step = options.RateStep(interval_s, c.lens[kFocal]);
  const Eigen::Index values = (samples + step - 1) / step;
  s->N.setZero(e.r.size(), 8 + 3 * values);
  s->N.col(0) = e.J[CoplanarityPlane::kTauBlock] * u;
  s->N.col(1) = e.J[CoplanarityPlane::kTauBlock] * v;
  s->N.middleCols<6>(2) = e.J[CoplanarityPlane::kBendBlock];
  Eigen::VectorXd rate_prior(3 * values);
  for (Eigen::Index k = 0; k < values; ++k) {
    const Eigen::Index count = std::min(step, samples - k * step);
    for (Eigen::Index i = k * step; i < k * step + count; ++i) {
      s->N.middleCols<3>(8 + 3 * k) += by_rates.middleCols<3>(3 * i);
    }
    rate_prior.segment<3>(3 * k) =
        static_cast<double>(count) * options.gyro_sigma_rad_s.cwiseAbs2().cwiseInverse();
  }
  s->prior.setZero(s->N.cols());
  s->prior.segment<6>(2) = view.bend_sigma_rad.cwiseAbs2().cwiseInverse();
  s->prior.tail(3 * values) = rate_prior;
  s->at = Eigen::VectorXd::Zero(s->N.cols());
  s->at.segment<6>(2) = plane.bend;
  if (all.free_turn_rad_s > 0.0) {
    s->bend_column = 2;
    s->free_bend = BendSigma(all.free_turn_rad_s, c.readout_s, pair.time_b_s - pair.time_a_s)
                       .cwiseAbs2()
                       .cwiseInverse();
  }
  return true;
}

bool RotationSystem(const EstimationInput& input, const TimedPair& pair, const Calibration& c,
                    const AllEffects& all, double noise, const PairGraphOptions& options,
                    PairSystem* s) {
  auto m = std::make_shared<RelativeRotation::Measurement>();
  Eigen::Matrix3Xd rates;
  if (!RatesOfPair(input, pair, c, &m->rate_times_s, &rates)) return false;
  m->rate_group_sizes = {static_cast<int>(rates.cols())};
  m->q_a_b = pair.rotation.q_a_b;
  m->frame_a = pair.first();
  m->frame_b = pair.second();
  m->sigma_rad = noise;
  m->robust_threshold = options.robust_threshold;
  m->effects = all.set->size() > 0 ? all.set : nullptr;
  const RelativeRotation cost(m);
  const ShutterParameters shutter = ShutterOf(c);
  std::vector<const double*> parameters = {shutter.data(), c.q_gyro_cam.coeffs().data()};
  if (m->effects) parameters.push_back(all.values.data());
  parameters.push_back(rates.data());
  const Evaluated e = Evaluate(cost, parameters);
  if (e.r.size() == 0) return false;
  const RowMajor& by_rates = e.J.back();
  const Eigen::MatrixXd through_rates = by_rates * RateColumnsOf(all, m->rate_times_s, rates);
  s->r = e.r;
  s->J.setZero(3, kStateSize + all.set->size());
  s->J.col(kStateDelay) = e.J[0].col(kDelay);
  s->J.middleCols<3>(kStateBias) = -through_rates.leftCols<3>();
  RotationManifold manifold;
  Eigen::Matrix<double, 4, 3, Eigen::RowMajor> plus;
  manifold.PlusJacobian(c.q_gyro_cam.coeffs().data(), plus.data());
  s->J.middleCols<3>(kStateRotation) = e.J[1] * plus;
  s->J.rightCols(all.set->size()) = -through_rates.rightCols(all.set->size());
  if (m->effects) s->J.rightCols(all.set->size()) += e.J[RelativeRotation::kEffectsBlock];
  s->N = by_rates;
  s->prior = options.gyro_sigma_rad_s.cwiseAbs2().cwiseInverse().replicate(rates.cols(), 1);
  s->at = Eigen::VectorXd::Zero(s->N.cols());
  s->bend_column = -1;
  return true;
}

}  // namespace

Scores ComputeScores(const EstimationInput& input, const std::vector<PairBlock>& blocks,
                     const Calibration& calibration, std::shared_ptr<const EffectSet> candidates,
                     double noise, const PairGraphOptions& options) {
  const AllEffects all = Join(calibration, candidates.get());
  Scores scores;
  scores.num_model = kStateSize + static_cast<int>(calibration.effect_values.size());
  const Eigen::Index size = kStateSize + all.set->size();
  for (const PairBlock& block : blocks) {
    BlockScore sum;
    sum.g.setZero(size);
    sum.H.setZero(size, size);
    if (!block.empty()) sum.time_s = 0.5 * (block.front().time_a_s + block.back().time_b_s);
    for (const TimedPair& pair : block) {
      const bool rotation = pair.matches.empty() && pair.rotation.frame_b > pair.rotation.frame_a;
      PairSystem system;
      if (!(rotation ? RotationSystem(input, pair, calibration, all, noise, options, &system)
                     : PixelSystem(input, pair, calibration, all, noise, options, &system))) {
        continue;
      }
      PairScore score;
      score.frame_b = pair.frame_b;
      score.time_s = pair.time_b_s;
      score.block = static_cast<int>(scores.blocks.size());
      // The direction takes two; the bend none, since chi2 has the penalty of its prior.
      score.residuals = static_cast<int>(system.r.size()) - (rotation ? 0 : 2);
      ProjectInto(system, scores.num_model, &score, &sum);
      scores.pairs.push_back(std::move(score));
    }
    if (sum.pairs > 0) scores.blocks.push_back(std::move(sum));
  }
  return scores;
}

std::vector<double> LatentGain(const Scores& scores) {
  std::vector<double> gain(scores.blocks.size(), 0.0);
  for (const PairScore& pair : scores.pairs) {
    gain[static_cast<size_t>(pair.block)] += pair.latent_gain;
  }
  return gain;
}

}  // namespace camgyro
