#include "estimator/window/pair_graph.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/gyro_gap.h"
#include "core/robust_statistics.h"
#include "core/so3.h"
#include "estimator/window/pair_blocks.h"
#include "estimator/window/pair_view.h"
#include "factors/bias_walk.h"
#include "factors/coplanarity_determinant.h"
#include "factors/coplanarity_plane.h"
#include "factors/gyro_rate.h"
#include "factors/marginal_prior.h"
#include "factors/relative_rotation.h"
#include "factors/symmetric_transfer.h"

namespace camgyro {
namespace {

// A gap of the gyro: longer than several sampling intervals.

std::vector<double> Intervals(const std::deque<TimedRate>& samples) {
  std::vector<double> intervals;
  for (size_t i = 1; i < samples.size(); ++i) {
    intervals.push_back(samples[i].time_s - samples[i - 1].time_s);
  }
  return intervals;
}

}  // namespace

int PairGraphOptions::RateStep(double interval_s, double focal_px) const {
  const double walk_px = gyro_sigma_rad_s.maxCoeff() * interval_s * focal_px;  // of a sample
  const double samples = 12.0 * rate_step_px * rate_step_px / (walk_px * walk_px);
  return std::max(1, static_cast<int>(std::min(samples, std::round(rate_step_s / interval_s))));
}

PairGraph::PairGraph(const Calibration& start, const Prior& prior, const PairGraphOptions& options)
    : options_(options), prior_mean_(prior.mean), prior_sigma_(prior.sigma) {
  const StateVector& sigma = prior.sigma;
  CHECK((sigma.array() > 0.0).all());
  Block lens{Geometry::kEuclidean, start.lens, {}};
  for (int k = kAspect; k < kLensSize; ++k) lens.constant.push_back(k);
  graph_.AddBlock(kLensBlock, std::move(lens));
  graph_.AddBlock(kShutterBlock, {Geometry::kEuclidean, ShutterOf(start), {}});
  graph_.AddBlock(kRotationBlock, {Geometry::kRotation, start.q_gyro_cam.coeffs(), {}});

  const int size = kLensSize + kShutterSize + 3;
  Eigen::VectorXd inv_sigma = Eigen::VectorXd::Zero(size);
  inv_sigma[kFocal] = 1.0 / sigma[kStateFocal];
  inv_sigma[kCx] = 1.0 / sigma[kStateCx];
  inv_sigma[kCy] = 1.0 / sigma[kStateCy];
  inv_sigma[kLensSize + kDelay] = 1.0 / sigma[kStateDelay];
  inv_sigma[kLensSize + kReadout] = 1.0 / sigma[kStateReadout];
  inv_sigma.tail<3>() = sigma.segment<3>(kStateRotation).cwiseInverse();
  graph_.AddFactor(std::make_shared<MarginalPrior>(
                       std::vector<MarginalPrior::Block>{{prior.mean.lens, false},
                                                         {ShutterOf(prior.mean), false},
                                                         {prior.mean.q_gyro_cam.coeffs(), true}},
                       inv_sigma.asDiagonal(), Eigen::VectorXd::Zero(size)),
                   {kLensBlock, kShutterBlock, kRotationBlock});
  prior_mean_.effects = start.effects;
  start_bias_ = start.bias_gyro_rad_s;
  turn_sigma_rad_s_ = options_.turn_sigma_rad_s;
  if (start.effects) {
    turn_sigma_rad_s_ =
        std::max(turn_sigma_rad_s_, start.effects->widened_sigma(PairLatent::kTurn));
  }
  if (const auto effects = Effects()) {
    num_effects_ = effects->size();
    CHECK_EQ(start.effect_values.size(), num_effects_);
    graph_.AddBlock(kEffectsBlock, {Geometry::kEuclidean, start.effect_values, {}});
    if (const int column = effects->frame_time_spread();
        column >= 0 && options.residual == ResidualKind::kPlane) {
      double& spread_s = graph_.value(kEffectsBlock)[column];
      if (spread_s <= 0.0) spread_s = effects->parameter(column).spread;
      frame_time_spread_s_ = std::make_shared<double>(spread_s);
    }
    AddEffectsPrior();
  }
}

void PairGraph::AddEffectsPrior() {
  Eigen::VectorXd inv_spread(num_effects_), mean = Eigen::VectorXd::Zero(num_effects_);
  for (int i = 0; i < num_effects_; ++i) inv_spread[i] = 1.0 / Effects()->parameter(i).spread;
  // What no residual depends on stays where it is.
  if (has_frame_times()) mean[Effects()->frame_time_spread()] = *frame_time_spread_s_;
  effects_prior_ = graph_.AddFactor(
      std::make_shared<MarginalPrior>(std::vector<MarginalPrior::Block>{{mean, false}},
                                      inv_spread.asDiagonal(), Eigen::VectorXd::Zero(num_effects_)),
      {kEffectsBlock});
}

PairEffects PairGraph::EffectsNow() const {
  if (num_effects_ == 0) return {};
  return {prior_mean_.effects.get(), graph_.value(kEffectsBlock).data()};
}

std::pair<double, double> PairGraph::Exposures(const FrameTime& frame_a,
                                               const FrameTime& frame_b) const {
  return ExposureSpan(graph_.value(kShutterBlock),
                      Eigen::Vector2d(prior_mean_.width_px, prior_mean_.height_px), EffectsNow(),
                      frame_a, frame_b);
}

void PairGraph::AddRate(const TimedRate& rate) {
  if (!samples_.empty()) CHECK_GT(rate.time_s, samples_.back().time_s);
  samples_.push_back(rate);
  // Estimated until the first group of rates is made: its size, and those of the groups that pairs
  // share with it, follow from it.
  if (next_group_ == 0 && samples_.size() >= 3 && samples_.size() <= 50) {
    std::vector<double> intervals = Intervals(samples_);
    // Stamps of samples that arrive in bunches have a median near zero.
    const double mean_s =
        (samples_.back().time_s - samples_.front().time_s) / static_cast<double>(intervals.size());
    median_interval_s_ = std::max(MedianInPlace(&intervals), mean_s);
  }
}

void PairGraph::AddBias(int64_t index) {
  if (graph_.Has(BiasBlock(index))) return;
  // The newest bias before it, if any is left.
  const Block* previous = nullptr;
  int64_t previous_index = 0;
  for (const auto& [id, block] : graph_.blocks()) {
    if (id.kind == BlockKind::kBias && id.index < index) {
      previous = &block;
      previous_index = id.index;
    }
  }
  const Eigen::VectorXd value = previous ? previous->value : Eigen::VectorXd(start_bias_);
  graph_.AddBlock(BiasBlock(index), {Geometry::kEuclidean, value, {}});
  if (previous) {
    graph_.AddFactor(std::make_shared<BiasWalk>(
                         options_.bias_walk_rad_s2_rtHz,
                         options_.bias_interval_s * static_cast<double>(index - previous_index)),
                     {BiasBlock(previous_index), BiasBlock(index)});
  } else {
    const Eigen::Vector3d inv_sigma = prior_sigma_.segment<3>(kStateBias).cwiseInverse();
    graph_.AddFactor(std::make_shared<MarginalPrior>(
                         std::vector<MarginalPrior::Block>{{prior_mean_.bias_gyro_rad_s, false}},
                         inv_sigma.asDiagonal(), Eigen::VectorXd::Zero(3)),
                     {BiasBlock(index)});
  }
}

Eigen::Vector3d PairGraph::ChainRateOf(int64_t number) const {
  const TimedRate& now = sample(number);
  if (number == first_sample_ ||
      number + 1 == first_sample_ + static_cast<int64_t>(samples_.size())) {
    return now.omega_gyro_rad_s;
  }
  const TimedRate &before = sample(number - 1), &after = sample(number + 1);
  return ChainRate(before.omega_gyro_rad_s, now.omega_gyro_rad_s, after.omega_gyro_rad_s,
                   now.time_s - before.time_s, after.time_s - now.time_s);
}

int PairGraph::RateStep() const {
  if (num_effects_ > 0) {
    for (const auto& item : prior_mean_.effects->items()) {
      if (item.entry->part == ModelPart::kRate) return 1;
    }
  }
  return options_.RateStep(median_interval_s_, prior_mean_.lens[kFocal]);
}

AddPairResult PairGraph::CoverWithRates(double from_s, double to_s, int step,
                                        std::vector<int64_t>* groups, std::vector<double>* times,
                                        std::vector<int>* sizes) {
  // One sample beyond, for the rate at the last one.
  if (samples_.size() < 3 || samples_[samples_.size() - 2].time_s < to_s) {
    return AddPairResult::kGyroTooLate;
  }
  if (samples_.front().time_s > from_s) return AddPairResult::kGyroTooEarly;
  const auto by_time = [](const TimedRate& rate, double t) { return rate.time_s < t; };
  // First needed: the last sample not after from_s; last needed: the first not before to_s.
  const auto lower = std::lower_bound(samples_.begin(), samples_.end(), from_s, by_time);
  int64_t first = first_sample_ + (lower - samples_.begin());
  if (sample(first).time_s > from_s) --first;
  const int64_t last =
      first_sample_ +
      (std::lower_bound(samples_.begin(), samples_.end(), to_s, by_time) - samples_.begin());
  for (int64_t i = first; i < last; ++i) {
    const double gap = sample(i + 1).time_s - sample(i).time_s;
    if (sample(i).saturated || sample(i + 1).saturated) return AddPairResult::kGyroGap;
    if (gap > LongestGyroStep(median_interval_s_)) return AddPairResult::kGyroGap;
  }
  // Groups that exist and reach into the span; then one new group with the rest.
  int64_t covered_until = first;  // first sample not yet covered
  for (const auto& [id, group] : groups_) {
    if (group.first_sample + group.count <= first) continue;
    if (group.first_sample > last) break;
    // A pair that goes back before the first group cannot be served: samples are missing.
    if (groups->empty() && group.first_sample > first) return AddPairResult::kGyroTooEarly;
    groups->push_back(id);
    covered_until = group.first_sample + group.count;
  }
  if (covered_until <= last) {
    RateGroup group;
    group.first_sample = covered_until;
    group.count = static_cast<int>(last + 1 - covered_until);
    group.bias_index =
        static_cast<int64_t>(std::floor(sample(covered_until).time_s / options_.bias_interval_s));
    AddBias(group.bias_index);
    Eigen::Matrix3Xd measured(3, group.count);
    for (int i = 0; i < group.count; ++i) {
      measured.col(i) = ChainRateOf(covered_until + i);
    }
    const Eigen::Vector3d bias = graph_.value(BiasBlock(group.bias_index));
    Eigen::Matrix3Xd rates = measured.colwise() - bias;
    std::vector<double> group_times;
    std::vector<BlockId> rate_blocks = {RatesBlock(next_group_), BiasBlock(group.bias_index)};
    if (num_effects_ > 0 && step == 1) {
      rate_blocks.push_back(kEffectsBlock);
      for (int i = 0; i < group.count; ++i) {
        group_times.push_back(sample(covered_until + i).time_s);
        rates.col(i) = TrueRate(EffectsNow(), group_times.back(), rates.col(i));
      }
    }
    const int64_t id = next_group_++;
    if (step > 1) {
      // Corrections x of rates less the bias of now: x + bias - bias of now is noise.
      std::vector<int> samples;
      for (int i = 0; i < group.count; i += step)
        samples.push_back(std::min(step, group.count - i));
      const auto values = static_cast<Eigen::Index>(samples.size());
      group.base = rates;
      graph_.AddBlock(RatesBlock(id),
                      {Geometry::kEuclidean, Eigen::VectorXd::Zero(3 * values), {}});
      group.factor = graph_.AddFactor(
          std::make_shared<GyroRate>(bias.replicate(1, values), samples, options_.gyro_sigma_rad_s),
          {RatesBlock(id), BiasBlock(group.bias_index)});
    } else {
      graph_.AddBlock(RatesBlock(id),
                      {Geometry::kEuclidean,
                       Eigen::Map<const Eigen::VectorXd>(rates.data(), rates.size()),
                       {}});
      group.factor =
          graph_.AddFactor(std::make_shared<GyroRate>(measured, options_.gyro_sigma_rad_s,
                                                      Effects(), std::move(group_times)),
                           std::move(rate_blocks));
    }
    groups_.emplace(id, group);
    groups->push_back(id);
  }
  for (const int64_t id : *groups) {
    const RateGroup& group = groups_.at(id);
    sizes->push_back(group.count);
    for (int i = 0; i < group.count; ++i) times->push_back(sample(group.first_sample + i).time_s);
  }
  return AddPairResult::kAdded;
}

AddPairResult PairGraph::AddPair(int64_t id, const FrameTime& frame_a, const FrameTime& frame_b,
                                 const std::vector<Match>& matches) {
  CHECK(pairs_.count(id) == 0);
  LensParameters lens = graph_.value(kLensBlock);
  if (num_effects_ > 0 && options_.drop_without_ray) {
    lens = prior_mean_.effects->ConstantLens(lens, graph_.value(kEffectsBlock));
  }
  Pair pair;
  pair.time_s = frame_a.stamp_s;
  pair.measurement = std::make_shared<PairMeasurement>();
  PairMeasurement& m = *pair.measurement;
  m.lens = &GetLens(prior_mean_.distortion_model);
  RayJet ray;
  for (const Match& match : matches) {
    if (m.lens->Unproject(match.px_a, lens, &ray, LensDerivatives::kNone) &&
        m.lens->Unproject(match.px_b, lens, &ray, LensDerivatives::kNone)) {
      m.matches.push_back(match);
    }
  }
  if (static_cast<int>(m.matches.size()) < kMinMatches) return AddPairResult::kTooFewMatches;
  const auto [first, last] = Exposures(frame_a, frame_b);
  const AddPairResult covered =
      CoverWithRates(first - RateMargin(), last + RateMargin(), RateStep(), &pair.groups,
                     &m.rate_times_s, &m.rate_group_sizes);
  if (covered != AddPairResult::kAdded) return covered;
  m.rate_step = RateStep();
  if (m.rate_step > 1) {
    m.rate_base.resize(3, static_cast<Eigen::Index>(m.rate_times_s.size()));
    Eigen::Index column = 0;
    for (const int64_t group : pair.groups) {
      const Eigen::Matrix3Xd& base = groups_.at(group).base;
      m.rate_base.middleCols(column, base.cols()) = base;
      column += base.cols();
    }
  }
  m.frame_a = frame_a;
  m.frame_b = frame_b;
  m.size_px << prior_mean_.width_px, prior_mean_.height_px;
  m.effects = Effects();
  if (m.effects == nullptr) m.by_lens = LensDerivatives::kPinhole;  // the others are held
  m.sigma_px = options_.sigma_px;
  m.noise = options_.match_noise;
  m.robust_threshold = options_.robust_threshold;
  if (options_.residual == ResidualKind::kSymmetricTransfer && !KeepTransferable(&pair)) {
    return AddPairResult::kTooFewMatches;
  }

  std::vector<BlockId> blocks = {kLensBlock, kShutterBlock, kRotationBlock};
  if (options_.residual == ResidualKind::kPlane) {
    graph_.AddBlock(DirectionBlock(id), {Geometry::kDirection, Eigen::Vector3d::UnitZ(), {}});
    blocks.push_back(DirectionBlock(id));
    graph_.AddBlock(BendBlock(id), {Geometry::kEuclidean, BendVector::Zero(), {}});
    blocks.push_back(BendBlock(id));
    const double readout_s = graph_.value(kShutterBlock)[kReadout];
    const double gap_s = frame_b.stamp_s - frame_a.stamp_s;
    m.readout_over_gap = readout_s / gap_s;
    pair.bend_sigma_rad = BendSigma(turn_sigma_rad_s_, readout_s, gap_s);
    const BendVector inv_sigma = pair.bend_sigma_rad.cwiseInverse();
    pair.bend_prior =
        graph_.AddFactor(std::make_shared<MarginalPrior>(
                             std::vector<MarginalPrior::Block>{{BendVector::Zero(), false}},
                             inv_sigma.asDiagonal(), BendVector::Zero()),
                         {BendBlock(id)});
  }
  if (num_effects_ > 0) blocks.push_back(kEffectsBlock);
  m.own_times = has_frame_times();
  AddFrameTimes(frame_a, frame_b, &pair, &blocks);
  for (const int64_t group : pair.groups) blocks.push_back(RatesBlock(group));
  if (options_.residual == ResidualKind::kPlane) {
    pair.factor = graph_.AddFactor(std::make_shared<CoplanarityPlane>(pair.measurement), blocks);
  } else if (options_.residual == ResidualKind::kSymmetricTransfer) {
    pair.factor = graph_.AddFactor(std::make_shared<SymmetricTransfer>(pair.measurement), blocks);
  } else {
    const int count = static_cast<int>(m.matches.size());
    pair.factor = graph_.AddFactor(
        std::make_shared<CoplanarityDeterminant>(
            pair.measurement, RandomTriplets(count, count, static_cast<uint64_t>(id) + 1)),
        blocks);
  }
  pairs_.emplace(id, std::move(pair));
  if (options_.residual == ResidualKind::kPlane) Residuals(id, /*search=*/true);
  return AddPairResult::kAdded;
}

bool PairGraph::KeepTransferable(Pair* pair) const {
  PairMeasurement& m = *pair->measurement;
  std::vector<const double*> groups;
  for (const int64_t group : pair->groups) groups.push_back(graph_.value(RatesBlock(group)).data());
  const RotationChain chain(m.rate_times_s, GatherRates(m, groups.data()));
  const LensParameters lens = graph_.value(kLensBlock);
  PairBearings bearings;
  if (!EvaluatePairBearings(m, chain, lens.data(), graph_.value(kShutterBlock).data(),
                            graph_.value(kRotationBlock).data(), nullptr, false, &bearings)) {
    return false;
  }
  std::vector<Match> kept;
  for (size_t i = 0; i < m.matches.size(); ++i) {
    if (HasTransfer(*m.lens, lens, bearings.a[i], bearings.b[i])) kept.push_back(m.matches[i]);
  }
  m.matches = std::move(kept);
  return static_cast<int>(m.matches.size()) >= kMinMatches;
}

AddPairResult PairGraph::AddRotation(int64_t id, const FrameTime& frame_a, const FrameTime& frame_b,
                                     const Eigen::Quaterniond& q_a_b, double sigma_rad) {
  CHECK(pairs_.count(id) == 0);
  Pair pair;
  pair.time_s = frame_a.stamp_s;
  pair.rotation = std::make_shared<RelativeRotation::Measurement>();
  RelativeRotation::Measurement& m = *pair.rotation;
  const auto [first, last] = Exposures(frame_a, frame_b);
  const AddPairResult covered =
      CoverWithRates(first - RateMargin(), last + RateMargin(), /*step=*/1, &pair.groups,
                     &m.rate_times_s, &m.rate_group_sizes);
  if (covered != AddPairResult::kAdded) return covered;
  m.q_a_b = q_a_b;
  m.frame_a = frame_a;
  m.frame_b = frame_b;
  m.effects = Effects();
  m.sigma_rad = sigma_rad;
  m.robust_threshold = options_.robust_threshold;
  std::vector<BlockId> blocks = {kShutterBlock, kRotationBlock};
  if (num_effects_ > 0) blocks.push_back(kEffectsBlock);
  m.own_times = has_frame_times();
  AddFrameTimes(frame_a, frame_b, &pair, &blocks);
  for (const int64_t group : pair.groups) blocks.push_back(RatesBlock(group));
  pair.factor = graph_.AddFactor(std::make_shared<RelativeRotation>(pair.rotation), blocks);
  pairs_.emplace(id, std::move(pair));
  return AddPairResult::kAdded;
}

SolveReport PairGraph::Solve(const SolveOptions& options) { return graph_.Solve(options); }

void PairGraph::MarginalizeOldest() {
  CHECK(!pairs_.empty());
  const auto oldest = pairs_.begin();
  std::set<int64_t> still_needed, frames_needed;
  for (auto it = std::next(oldest); it != pairs_.end(); ++it) {
    still_needed.insert(it->second.groups.begin(), it->second.groups.end());
    frames_needed.insert(it->second.frame_times.begin(), it->second.frame_times.end());
  }
  // The last group stays: the next pair will start inside it.
  if (!groups_.empty()) still_needed.insert(groups_.rbegin()->first);
  std::vector<BlockId> leaving;
  if (graph_.Has(DirectionBlock(oldest->first))) {
    leaving.push_back(DirectionBlock(oldest->first));
    leaving.push_back(BendBlock(oldest->first));
  }
  for (auto it = groups_.begin(); it != groups_.end() && still_needed.count(it->first) == 0;) {
    leaving.push_back(RatesBlock(it->first));
    it = groups_.erase(it);
  }
  for (const int64_t frame : oldest->second.frame_times) {
    if (frames_needed.count(frame) > 0) continue;
    leaving.push_back(FrameTimeBlock(frame));
    frame_time_priors_.erase(frame);
  }
  const int64_t first_bias = groups_.empty() ? 0 : groups_.begin()->second.bias_index;
  for (const auto& [id, block] : graph_.blocks()) {
    if (id.kind == BlockKind::kBias && id.index < first_bias) leaving.push_back(id);
  }
  // The pair's own factor leaves even where no block of it does (determinants have no direction).
  graph_.Marginalize(leaving, {oldest->second.factor});
  pairs_.erase(oldest);
}

void PairGraph::ForgetOldRates(double before_s) {
  while (samples_.size() > 1 && samples_.front().time_s < before_s &&
         (groups_.empty() || first_sample_ < groups_.begin()->second.first_sample)) {
    samples_.pop_front();
    ++first_sample_;
  }
}

void PairGraph::SetSigma(int64_t id, double sigma) {
  CHECK_GT(sigma, 0.0);
  const Pair& pair = pairs_.at(id);
  if (pair.measurement != nullptr) {
    pair.measurement->sigma_px = sigma;
  } else {
    pair.rotation->sigma_rad = sigma;
  }
}

std::vector<int64_t> PairGraph::pair_ids() const {
  std::vector<int64_t> ids;
  for (const auto& entry : pairs_) ids.push_back(entry.first);
  return ids;
}

}  // namespace camgyro
