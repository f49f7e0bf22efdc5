#include "estimator/window/pair_graph.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "estimator/window/pair_blocks.h"
#include "estimator/window/pair_view.h"
#include "factors/gaussian_prior.h"

namespace camgyro {
namespace {

// A pair keeps its linearisation while its direction and bend have moved by less than this [rad],
// too: a pair with little parallax hardly knows its direction, and turning it moves no residual
// much although each of them bends.
constexpr double kHeldTurn = 0.01;

std::shared_ptr<const EffectSet> WithParameters(const Calibration& start) {
  return start.effects && start.effects->size() > 0 ? start.effects : nullptr;
}

// Those through which the derivatives by effects go; the other parameters of the lens are held.
LensDerivatives DerivativesFor(const EffectSet* effects) {
  const int number = effects == nullptr ? 0 : effects->num_lens();
  if (number > kKb1) return LensDerivatives::kAll;
  return number > 0 ? LensDerivatives::kRadTan : LensDerivatives::kPinhole;
}

}  // namespace

PairGraph::PairGraph(const Calibration& start, const Prior& prior, const PairGraphOptions& options,
                     std::shared_ptr<const PairLatents> latents)
    : options_(options),
      start_(std::move(latents)),
      prior_mean_(prior.mean),
      effect_prior_sigma_(prior.effect_sigma),
      effects_(WithParameters(start)),
      rates_(options, prior, start.bias_gyro_rad_s, effects_,
             start_ != nullptr ? &start_->rates : nullptr),
      turn_sigma_rad_s_(options.turn_sigma_rad_s) {
  prior_mean_.effects = start.effects;
  const bool held = options.hold_shared;
  Block lens{Geometry::kEuclidean, start.lens, {}, held};
  for (int k = kAspect; k < kLensSize; ++k) lens.constant.push_back(k);
  graph_.AddBlock(kLensBlock, std::move(lens));
  graph_.AddBlock(kShutterBlock, {Geometry::kEuclidean, ShutterOf(start), {}, held});
  graph_.AddBlock(kRotationBlock, {Geometry::kRotation, start.q_gyro_cam.coeffs(), {}, held});
  AddStatePrior(prior);
  if (start.effects) {
    turn_sigma_rad_s_ =
        std::max(turn_sigma_rad_s_, start.effects->widened_sigma(PairLatent::kTurn));
  }
  if (effects_ == nullptr) return;
  CHECK_EQ(start.effect_values.size(), effects_->size());
  CHECK(effect_prior_sigma_.size() == 0 ||
        (effect_prior_sigma_.size() == effects_->size() && prior.mean.effects == start.effects));
  graph_.AddBlock(kEffectsBlock, {Geometry::kEuclidean, start.effect_values, {}, held});
  if (const int column = effects_->frame_time_spread();
      column >= 0 && residual().facts().with_frame_times) {
    double& spread_s = graph_.value(kEffectsBlock)[column];
    if (spread_s <= 0.0) spread_s = effects_->parameter(column).spread;
    frame_time_spread_s_ = std::make_shared<double>(spread_s);
  }
  AddEffectsPrior();
}

void PairGraph::AddStatePrior(const Prior& prior) {
  const StateVector& sigma = prior.sigma;
  LensParameters lens_sigma;
  lens_sigma.setConstant(std::numeric_limits<double>::infinity());  // held
  lens_sigma[kFocal] = sigma[kStateFocal];
  lens_sigma[kCx] = sigma[kStateCx];
  lens_sigma[kCy] = sigma[kStateCy];
  ShutterParameters shutter_sigma;
  shutter_sigma[kDelay] = sigma[kStateDelay];
  shutter_sigma[kReadout] = sigma[kStateReadout];
  state_prior_ = graph_.AddFactor(
      std::make_shared<GaussianPrior>(std::vector<GaussianPrior::Block>{
          {prior.mean.lens, lens_sigma, false},
          {ShutterOf(prior.mean), shutter_sigma, false},
          {prior.mean.q_gyro_cam.coeffs(), sigma.segment<3>(kStateRotation), true}}),
      {kLensBlock, kShutterBlock, kRotationBlock});
}

void PairGraph::AddEffectsPrior() {
  Eigen::VectorXd spread(effects_->size()), mean = Eigen::VectorXd::Zero(effects_->size());
  for (int i = 0; i < effects_->size(); ++i) spread[i] = effects_->parameter(i).spread;
  if (effect_prior_sigma_.size() > 0) {
    mean = prior_mean_.effect_values;
    spread = effect_prior_sigma_;
  }
  // What no residual depends on stays where it is.
  if (has_frame_times()) mean[effects_->frame_time_spread()] = *frame_time_spread_s_;
  effects_prior_ = graph_.AddFactor(
      std::make_shared<GaussianPrior>(std::vector<GaussianPrior::Block>{{mean, spread, false}}),
      {kEffectsBlock});
}

PairEffects PairGraph::EffectsNow() const {
  if (effects_ == nullptr) return {};
  return {effects_.get(), graph_.value(kEffectsBlock).data()};
}

std::pair<double, double> PairGraph::Exposures(const FrameTime& frame_a,
                                               const FrameTime& frame_b) const {
  return ExposureSpan(graph_.value(kShutterBlock),
                      Eigen::Vector2d(prior_mean_.width_px, prior_mean_.height_px), EffectsNow(),
                      frame_a, frame_b);
}

PairParameters PairGraph::SharedParameters() const {
  PairParameters at;
  at.lens = graph_.value(kLensBlock).data();
  at.shutter = graph_.value(kShutterBlock).data();
  at.q_gyro_cam = graph_.value(kRotationBlock).data();
  at.effects = EffectsNow().values;
  return at;
}

PairParameters PairGraph::ParametersOf(int64_t id, const Pair& pair) const {
  PairParameters at = SharedParameters();
  if (residual().facts().has_direction) {
    at.tau = graph_.value(DirectionBlock(id)).data();
    at.bend = graph_.value(BendBlock(id)).data();
  }
  for (size_t k = 0; k < pair.frame_times.size(); ++k) {
    at.own_times.at(k) = graph_.value(FrameTimeBlock(pair.frame_times[k])).data();
  }
  for (const int64_t group : pair.groups) {
    at.rates.push_back(graph_.value(RatesBlock(group)).data());
  }
  return at;
}

std::shared_ptr<PairMeasurement> PairGraph::Measure(const TimedPair& pair) const {
  auto measurement = std::make_shared<PairMeasurement>();
  PairMeasurement& m = *measurement;
  m.frame_a = pair.first();
  m.frame_b = pair.second();
  m.size_px << prior_mean_.width_px, prior_mean_.height_px;
  m.effects = effects_;
  m.by_lens = options_.hold_shared ? LensDerivatives::kNone : DerivativesFor(effects_.get());
  m.sigma = options_.first_sigma() * pair.noise_factor;
  m.noise = options_.match_noise;
  m.robust_threshold = options_.robust_threshold;
  m.own_times = has_frame_times();
  if (residual().facts().of_attitudes) {
    m.q_a_b = pair.rotation.q_a_b;
    return measurement;
  }
  LensParameters lens = graph_.value(kLensBlock);
  if (effects_ != nullptr && options_.drop_without_ray) {
    lens = effects_->ConstantLens(lens, graph_.value(kEffectsBlock));
  }
  m.lens = &GetLens(prior_mean_.distortion_model);
  RayJet ray;
  for (const Match& match : pair.matches) {
    if (m.lens->Unproject(match.px_a, lens, &ray, LensDerivatives::kNone) &&
        m.lens->Unproject(match.px_b, lens, &ray, LensDerivatives::kNone)) {
      m.matches.push_back(match);
    }
  }
  return measurement;
}

AddPairResult PairGraph::AddPair(const TimedPair& timed) {
  CHECK(pairs_.count(timed.id) == 0);
  // First whatever may be refused, without a change; then whatever is added.
  const PairResidual::Facts& facts = residual().facts();
  Pair pair;
  pair.time_s = timed.time_a_s;
  pair.measurement = Measure(timed);
  PairMeasurement& m = *pair.measurement;
  const auto too_few = [&] {
    return !facts.of_attitudes && static_cast<int>(m.matches.size()) < kMinMatches;
  };
  if (too_few()) return AddPairResult::kTooFewMatches;
  const auto [first, last] = Exposures(m.frame_a, m.frame_b);
  RateGroups::Cover cover;
  const AddPairResult covered =
      rates_.Plan(first - RateMargin(), last + RateMargin(),
                  facts.of_attitudes ? 1 : rates_.Step(prior_mean_.lens[kFocal]), graph_, &cover);
  if (covered != AddPairResult::kAdded) return covered;
  pair.groups = cover.groups;
  m.rate_times_s = cover.times_s;
  m.rate_group_sizes = cover.sizes;
  m.rate_step = cover.step;
  m.rate_base = cover.base;
  if (facts.drops_matches && (!KeepMatches(cover, &m) || too_few())) {
    return AddPairResult::kTooFewMatches;
  }

  rates_.AddTo(cover, &graph_);
  if (facts.has_direction) AddDirection(timed.id, &pair);
  AddFrameTimes(timed, &pair);
  MakeFactor(timed.id, &pair);
  pairs_.emplace(timed.id, std::move(pair));
  const bool is_known = start_ != nullptr && start_->planes.count(timed.id) > 0;
  if (facts.has_direction && !is_known) Residuals(timed.id, /*search=*/true);
  return AddPairResult::kAdded;
}

void PairGraph::MakeFactor(int64_t id, Pair* pair) {
  if (options_.hold_shared && !residual().facts().of_attitudes) {
    const PairParameters at = SharedParameters();
    HoldRays(at.lens, at.shutter, at.effects, pair->measurement.get());
  }
  std::shared_ptr<const ceres::CostFunction> cost = residual().MakeCost(pair->measurement, id);
  if (options_.keep_within_sigmas >= 0.0) {
    KeepBounds bounds{options_.keep_within_sigmas, {}};
    if (residual().facts().has_direction) {
      bounds.blocks = {{CoplanarityPlane::kTauBlock, kHeldTurn},
                       {CoplanarityPlane::kBendBlock, kHeldTurn}};
    }
    pair->kept = std::make_shared<KeptCost>(std::move(cost), std::move(bounds));
    pair->last.linearisation = 0;
    cost = pair->kept;
  }
  pair->factor = graph_.AddFactor(std::move(cost), BlocksOf(id, *pair));
}

void PairGraph::LeaveOutTracks(const std::vector<int64_t>& track_ids) {
  for (auto& [id, pair] : pairs_) {
    auto kept = std::make_shared<PairMeasurement>(*pair.measurement);
    EraseMatchesOf(track_ids, &kept->matches);
    if (kept->matches.size() == pair.measurement->matches.size() ||
        static_cast<int>(kept->matches.size()) < kMinMatches) {
      continue;
    }
    graph_.RemoveFactor(pair.factor);
    pair.measurement = std::move(kept);
    MakeFactor(id, &pair);
  }
}

bool PairGraph::KeepMatches(const RateGroups::Cover& cover, PairMeasurement* pair) const {
  PairMeasurement& m = *pair;
  std::vector<const double*> groups;
  for (const int64_t group : cover.groups) {
    const bool is_there = graph_.Has(RatesBlock(group));
    groups.push_back(is_there ? graph_.value(RatesBlock(group)).data() : cover.values.data());
  }
  const RotationChain chain(m.rate_times_s, GatherRates(m, groups.data()));
  const LensParameters lens = graph_.value(kLensBlock);
  const PairParameters at = SharedParameters();
  PairBearings bearings;
  if (!EvaluatePairBearings(m, chain, at.lens, at.shutter, at.q_gyro_cam, at.effects, false,
                            &bearings)) {
    return false;
  }
  std::vector<Match> kept;
  for (size_t i = 0; i < m.matches.size(); ++i) {
    if (residual().HasResidual(*m.lens, lens, bearings.a[i], bearings.b[i])) {
      kept.push_back(m.matches[i]);
    }
  }
  m.matches = std::move(kept);
  return true;
}

void PairGraph::AddDirection(int64_t id, Pair* pair) {
  PairPlane plane{Eigen::Vector3d::UnitZ(), BendVector::Zero()};
  if (start_ != nullptr) {
    const auto known = start_->planes.find(id);
    if (known != start_->planes.end()) {
      plane = known->second.plane.TurnedBy(ReferenceFrom(*pair, known->second.time_s));
    }
  }
  graph_.AddBlock(DirectionBlock(id), {Geometry::kDirection, plane.tau, {}});
  graph_.AddBlock(BendBlock(id), {Geometry::kEuclidean, plane.bend, {}});
  PairMeasurement& m = *pair->measurement;
  const Scan scan = ScanOf(graph_.value(kShutterBlock), m.size_px, EffectsNow(), m.frame_a);
  const double gap_s = m.frame_b.stamp_s - m.frame_a.stamp_s;
  m.scan_shares = scan.shares;
  m.readout_over_gap = scan.readout_s / gap_s;
  pair->bend_sigma_rad = BendSigma(turn_sigma_rad_s_, scan.readout_s, gap_s);
  pair->bend_prior = graph_.AddFactor(
      std::make_shared<GaussianPrior>(
          std::vector<GaussianPrior::Block>{{BendVector::Zero(), pair->bend_sigma_rad, false}}),
      {BendBlock(id)});
}

Eigen::Matrix3d PairGraph::ReferenceFrom(const Pair& pair, double time_s) const {
  const PairMeasurement& m = *pair.measurement;
  std::vector<const double*> groups;
  for (const int64_t group : pair.groups) groups.push_back(graph_.value(RatesBlock(group)).data());
  return RotationChain(m.rate_times_s, GatherRates(m, groups.data())).At(time_s).R_ref_gyro;
}

std::vector<BlockId> PairGraph::BlocksOf(int64_t id, const Pair& pair) const {
  std::vector<BlockId> blocks;
  size_t next_time = 0, next_group = 0;
  for (const BlockKind kind : residual().Blocks(*pair.measurement)) {
    int64_t index = 0;  // of what all pairs share
    if (kind == BlockKind::kDirection || kind == BlockKind::kBend) index = id;
    if (kind == BlockKind::kFrameTime) index = pair.frame_times.at(next_time++);
    if (kind == BlockKind::kRates) index = pair.groups.at(next_group++);
    blocks.push_back({kind, index});
  }
  return blocks;
}

SolveReport PairGraph::Solve(const SolveOptions& options) { return graph_.Solve(options); }

int PairGraph::skew_column() const {
  if (effects_ == nullptr) return -1;
  for (const EffectSet::Item& item : effects_->items()) {
    if (item.entry->name == "clock_skew") return item.first;
  }
  return -1;
}

std::optional<FactorGraph::Walk> PairGraph::SkewWalk(double skew_walk_rtHz) const {
  if (!(skew_walk_rtHz > 0.0) || pairs_.size() < 2) return std::nullopt;
  const int column = skew_column();
  if (column < 0) return std::nullopt;
  const Pair &oldest = pairs_.begin()->second, &next = std::next(pairs_.begin())->second;
  // The delay of the next pair is what it is: only the rate has changed until then.
  const Eigen::VectorXd by_effects = DelayByEffects(next.measurement->frame_a);
  FactorGraph::Walk walk;
  walk.direction = {{kEffectsBlock, column, 1.0}, {kShutterBlock, kDelay, -by_effects[column]}};
  walk.sigma = 1e6 * skew_walk_rtHz * std::sqrt(std::max(1e-3, next.time_s - oldest.time_s));
  return walk;
}

Status PairGraph::MarginalizeOldest(double skew_walk_rtHz) {
  CHECK(!pairs_.empty());
  const auto oldest = pairs_.begin();
  std::set<int64_t> groups_needed, frames_needed;
  for (auto it = std::next(oldest); it != pairs_.end(); ++it) {
    groups_needed.insert(it->second.groups.begin(), it->second.groups.end());
    frames_needed.insert(it->second.frame_times.begin(), it->second.frame_times.end());
  }
  std::vector<BlockId> leaving;
  if (graph_.Has(DirectionBlock(oldest->first))) {
    leaving.push_back(DirectionBlock(oldest->first));
    leaving.push_back(BendBlock(oldest->first));
  }
  const std::vector<int64_t> groups = rates_.Unneeded(groups_needed);
  for (const int64_t group : groups) leaving.push_back(RatesBlock(group));
  std::vector<int64_t> frames;
  for (const int64_t frame : oldest->second.frame_times) {
    if (frames_needed.count(frame) > 0) continue;
    leaving.push_back(FrameTimeBlock(frame));
    frames.push_back(frame);
  }
  for (const BlockId& bias : rates_.BiasesOnlyOf(groups, graph_)) leaving.push_back(bias);
  // The pair's own factor leaves even where no block of it does (determinants have no direction).
  std::vector<FactorGraph::FactorKey> also = {oldest->second.factor};
  const std::optional<FactorGraph::Walk> walk = SkewWalk(skew_walk_rtHz);
  if (walk) {
    also.push_back(state_prior_);
    // That of frames with times of their own is made anew with their spread.
    if (!has_frame_times()) also.push_back(effects_prior_);
  }
  if (const Result<int> done = graph_.Marginalize(leaving, also, walk); !done) {
    return tl::unexpected(done.error());
  }
  rates_.Drop(groups);
  for (const int64_t frame : frames) frame_time_priors_.erase(frame);
  pairs_.erase(oldest);
  return {};
}

void PairGraph::SetSigma(int64_t id, double sigma) {
  CHECK_GT(sigma, 0.0);
  Pair& pair = pairs_.at(id);
  if (pair.measurement->sigma == sigma) return;
  pair.measurement->sigma = sigma;
  if (pair.kept) pair.kept->Forget();
}

std::vector<int64_t> PairGraph::pair_ids() const {
  std::vector<int64_t> ids;
  for (const auto& entry : pairs_) ids.push_back(entry.first);
  return ids;
}

}  // namespace camgyro
