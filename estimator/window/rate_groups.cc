#include "estimator/window/rate_groups.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/gyro_gap.h"
#include "core/robust_statistics.h"
#include "estimator/window/pair_blocks.h"
#include "factors/bias_walk.h"
#include "factors/gaussian_prior.h"
#include "factors/gyro_rate.h"

namespace camgyro {
namespace {

std::vector<double> Intervals(const std::deque<TimedRate>& samples) {
  std::vector<double> intervals;
  for (size_t i = 1; i < samples.size(); ++i) {
    intervals.push_back(samples[i].time_s - samples[i - 1].time_s);
  }
  return intervals;
}

bool ChangesRates(const EffectSet& effects) {
  return std::any_of(effects.items().begin(), effects.items().end(),
                     [](const auto& item) { return item.entry->part == ModelPart::kRate; });
}

}  // namespace

double NeglectedPx(const std::vector<TimedRate>& rates, const PairGraphOptions& options,
                   double focal_px, const EffectSet& effects, const Eigen::VectorXd& from,
                   const Eigen::VectorXd& to) {
  if (rates.size() < 2 || !ChangesRates(effects)) return 0.0;
  const double interval_s =
      (rates.back().time_s - rates.front().time_s) / static_cast<double>(rates.size() - 1);
  const auto step = static_cast<size_t>(options.RateStep(interval_s, focal_px));
  double largest = 0.0;
  Eigen::Matrix3Xd columns(3, effects.size()), of_value(3, step);
  for (size_t first = 0; first + step <= rates.size(); first += step) {
    for (size_t i = 0; i < step; ++i) {
      const TimedRate& rate = rates[first + i];
      of_value.col(static_cast<Eigen::Index>(i)) =
          effects.ChangeRate(rate.time_s, rate.omega_gyro_rad_s, to.data(), columns) -
          effects.ChangeRate(rate.time_s, rate.omega_gyro_rad_s, from.data(), columns);
    }
    of_value.colwise() -= of_value.rowwise().mean().eval();
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    for (const auto& rate : of_value.colwise()) {
      turn += interval_s * rate;
      largest = std::max(largest, turn.norm());
    }
  }
  return focal_px * largest;
}

int PairGraphOptions::RateStep(double interval_s, double focal_px) const {
  constexpr double kMost = 1e6;  // an int holds it
  if (!(interval_s > 0.0)) return 1;
  const double walk_px = gyro_sigma_rad_s.maxCoeff() * interval_s * focal_px;  // of a sample
  const double samples = 12.0 * rate_step_px * rate_step_px / (walk_px * walk_px);
  return static_cast<int>(
      std::clamp(std::min(samples, std::round(rate_step_s / interval_s)), 1.0, kMost));
}

RateGroups::RateGroups(const PairGraphOptions& options, const Prior& prior,
                       const Eigen::Vector3d& start_bias, std::shared_ptr<const EffectSet> effects,
                       const RatesFound* start)
    : options_(options),
      prior_bias_(prior.mean.bias_gyro_rad_s),
      prior_bias_sigma_(prior.sigma.segment<3>(kStateBias)),
      start_bias_(start_bias),
      effects_(std::move(effects)),
      start_(start) {}

void RateGroups::Add(const TimedRate& rate) {
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

void RateGroups::Forget(double before_s) {
  while (samples_.size() > 1 && samples_.front().time_s < before_s &&
         (groups_.empty() || first_sample_ < groups_.begin()->second.first_sample)) {
    samples_.pop_front();
    ++first_sample_;
  }
}

int RateGroups::Step(double focal_px) const {
  return options_.RateStep(median_interval_s_, focal_px);
}

Eigen::Vector3d RateGroups::ChainRateOf(int64_t number) const {
  const TimedRate& now = sample(number);
  if (number == first_sample_ ||
      number + 1 == first_sample_ + static_cast<int64_t>(samples_.size())) {
    return now.omega_gyro_rad_s;
  }
  const TimedRate &before = sample(number - 1), &after = sample(number + 1);
  return ChainRate(before.omega_gyro_rad_s, now.omega_gyro_rad_s, after.omega_gyro_rad_s,
                   now.time_s - before.time_s, after.time_s - now.time_s);
}

AddPairResult RateGroups::FindSamples(double from_s, double to_s, int64_t* first,
                                      int64_t* last) const {
  // One sample beyond, for the rate at the last one.
  if (samples_.size() < 3 || samples_[samples_.size() - 2].time_s < to_s) {
    return AddPairResult::kGyroTooLate;
  }
  if (samples_.front().time_s > from_s) return AddPairResult::kGyroTooEarly;
  const auto by_time = [](const TimedRate& rate, double t) { return rate.time_s < t; };
  // First needed: the last sample not after from_s; last needed: the first not before to_s.
  const auto number_of = [&](double time_s) {
    return first_sample_ +
           (std::lower_bound(samples_.begin(), samples_.end(), time_s, by_time) - samples_.begin());
  };
  *first = number_of(from_s);
  if (sample(*first).time_s > from_s) --*first;
  *last = number_of(to_s);
  for (int64_t i = *first; i < *last; ++i) {
    const double gap = sample(i + 1).time_s - sample(i).time_s;
    if (sample(i).saturated || sample(i + 1).saturated) return AddPairResult::kGyroGap;
    if (gap > LongestGyroStep(median_interval_s_)) return AddPairResult::kGyroGap;
  }
  return AddPairResult::kAdded;
}

AddPairResult RateGroups::Plan(double from_s, double to_s, int step, const FactorGraph& graph,
                               Cover* cover) const {
  int64_t first = 0, last = 0;
  if (const AddPairResult found = FindSamples(from_s, to_s, &first, &last);
      found != AddPairResult::kAdded) {
    return found;
  }
  // Groups that exist and reach into the span; then one new group with the rest.
  cover->step = step;
  std::vector<const Group*> used;
  int64_t covered_until = first;  // first sample not yet covered
  for (const auto& [id, group] : groups_) {
    if (group.first_sample + group.count <= first) continue;
    if (group.first_sample > last) break;
    // A pair that goes back before the first group cannot be served: samples are missing.
    if (used.empty() && group.first_sample > first) return AddPairResult::kGyroTooEarly;
    used.push_back(&group);
    cover->groups.push_back(id);
    covered_until = group.first_sample + group.count;
  }
  if (covered_until <= last) {
    PlanGroup(covered_until, last, graph, cover);
    used.push_back(&cover->group);
  }
  for (const Group* group : used) {
    cover->sizes.push_back(group->count);
    for (int i = 0; i < group->count; ++i) {
      cover->times_s.push_back(sample(group->first_sample + i).time_s);
    }
  }
  if (step > 1) {
    cover->base.resize(3, static_cast<Eigen::Index>(cover->times_s.size()));
    Eigen::Index column = 0;
    for (const Group* group : used) {
      cover->base.middleCols(column, group->base.cols()) = group->base;
      column += group->base.cols();
    }
  }
  return AddPairResult::kAdded;
}

Eigen::Vector3d RateGroups::StartingCorrection(int64_t first, int count) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (start_ == nullptr) return sum;
  for (int64_t i = first; i < first + count; ++i) {
    const double time_s = sample(i).time_s;
    const auto after = std::upper_bound(
        start_->corrections.begin(), start_->corrections.end(), time_s,
        [](double t, const RatesFound::Correction& correction) { return t < correction.first_s; });
    if (after == start_->corrections.begin()) continue;
    const RatesFound::Correction& correction = *std::prev(after);
    if (time_s <= correction.last_s) sum += correction.value_rad_s;
  }
  return sum / count;
}

RatesFound RateGroups::Found(const FactorGraph& graph) const {
  RatesFound found;
  for (const auto& [id, group] : groups_) {
    const Factor& reading = graph.factors().at(group.factor);
    std::vector<const double*> values;
    for (const BlockId& block : reading.blocks) values.push_back(graph.value(block).data());
    Eigen::Matrix3Xd residuals(3, reading.cost->num_residuals() / 3);
    if (!reading.cost->Evaluate(values.data(), residuals.data(), nullptr)) continue;
    for (int k = 0; k < residuals.cols(); ++k) {
      const int64_t first = group.first_sample + k * group.step;
      const int count = std::min(group.step, group.count - k * group.step);
      found.corrections.push_back({sample(first).time_s, sample(first + count - 1).time_s,
                                   residuals.col(k).cwiseProduct(options_.gyro_sigma_rad_s) /
                                       std::sqrt(static_cast<double>(count))});
    }
    found.biases_rad_s[group.bias_index] = graph.value(BiasBlock(group.bias_index));
  }
  return found;
}

void RateGroups::PlanGroup(int64_t first, int64_t last, const FactorGraph& graph,
                           Cover* cover) const {
  Group& group = cover->group;
  cover->lacks_group = true;
  cover->groups.push_back(next_group_);
  group.first_sample = first;
  group.count = static_cast<int>(last + 1 - first);
  group.step = cover->step;
  group.bias_index =
      static_cast<int64_t>(std::floor(sample(first).time_s / options_.bias_interval_s));
  const Eigen::Vector3d bias = BiasAt(group.bias_index, graph);
  Eigen::Matrix3Xd measured(3, group.count);
  for (int i = 0; i < group.count; ++i) measured.col(i) = ChainRateOf(first + i);
  Eigen::Matrix3Xd rates = measured.colwise() - bias;
  std::vector<double> times_s;
  cover->reading_has_effects = effects_ != nullptr && ChangesRates(*effects_);
  if (cover->reading_has_effects) {
    const PairEffects now{effects_.get(), graph.value(kEffectsBlock).data()};
    for (int i = 0; i < group.count; ++i) {
      times_s.push_back(sample(first + i).time_s);
      rates.col(i) = TrueRate(now, times_s.back(), rates.col(i));
    }
  }
  if (cover->step > 1) {
    // Corrections x of what the rates are with the bias and the effects of now. How the samples of
    // one value differ stays as it is while effects change (NeglectedPx).
    std::vector<int> samples;
    Eigen::Matrix3Xd means = bias.replicate(1, (group.count + cover->step - 1) / cover->step);
    for (int i = 0; i < group.count; i += cover->step) {
      const int count = std::min(cover->step, group.count - i);
      if (cover->reading_has_effects) {
        means.col(i / cover->step) = (measured - rates).middleCols(i, count).rowwise().mean();
      }
      samples.push_back(count);
    }
    group.base = rates;
    Eigen::Matrix3Xd values(3, means.cols());
    for (int k = 0; k < values.cols(); ++k) {
      values.col(k) = StartingCorrection(first + k * cover->step, samples[static_cast<size_t>(k)]);
    }
    cover->values = values.reshaped();
    cover->reading = cover->reading_has_effects
                         ? std::make_shared<GyroRate>(means, samples, options_.gyro_sigma_rad_s,
                                                      effects_, std::move(times_s), rates)
                         : std::make_shared<GyroRate>(means, samples, options_.gyro_sigma_rad_s);
    return;
  }
  for (int i = 0; i < group.count; ++i) rates.col(i) += StartingCorrection(first + i, 1);
  cover->values = Eigen::Map<const Eigen::VectorXd>(rates.data(), rates.size());
  cover->reading = cover->reading_has_effects
                       ? std::make_shared<GyroRate>(measured, options_.gyro_sigma_rad_s, effects_,
                                                    std::move(times_s))
                       : std::make_shared<GyroRate>(measured, options_.gyro_sigma_rad_s);
}

void RateGroups::AddTo(const Cover& cover, FactorGraph* graph) {
  if (!cover.lacks_group) return;
  CHECK_EQ(cover.groups.back(), next_group_);
  const int64_t id = next_group_++;
  AddBias(cover.group.bias_index, graph);
  graph->AddBlock(RatesBlock(id), {Geometry::kEuclidean, cover.values, {}, options_.hold_shared});
  std::vector<BlockId> blocks = {RatesBlock(id), BiasBlock(cover.group.bias_index)};
  if (cover.reading_has_effects) blocks.push_back(kEffectsBlock);
  Group& group = groups_.emplace(id, cover.group).first->second;
  group.factor = graph->AddFactor(cover.reading, std::move(blocks));
}

BlockId RateGroups::BiasBefore(int64_t index, const FactorGraph& graph) {
  BlockId before = kLensBlock;
  for (const auto& [id, block] : graph.blocks()) {
    if (id.kind == BlockKind::kBias && id.index < index) before = id;
  }
  return before;
}

Eigen::Vector3d RateGroups::BiasAt(int64_t index, const FactorGraph& graph) const {
  if (graph.Has(BiasBlock(index))) return graph.value(BiasBlock(index));
  if (start_ != nullptr) {
    const auto known = start_->biases_rad_s.find(index);
    if (known != start_->biases_rad_s.end()) return known->second;
  }
  const BlockId before = BiasBefore(index, graph);
  return before.kind == BlockKind::kBias ? Eigen::Vector3d(graph.value(before)) : start_bias_;
}

void RateGroups::AddBias(int64_t index, FactorGraph* graph) const {
  if (graph->Has(BiasBlock(index))) return;
  const BlockId before = BiasBefore(index, *graph);
  graph->AddBlock(BiasBlock(index),
                  {Geometry::kEuclidean, BiasAt(index, *graph), {}, options_.hold_shared});
  if (before.kind == BlockKind::kBias) {
    graph->AddFactor(std::make_shared<BiasWalk>(
                         options_.bias_walk_rad_s2_rtHz,
                         options_.bias_interval_s * static_cast<double>(index - before.index)),
                     {before, BiasBlock(index)});
  } else {
    graph->AddFactor(std::make_shared<GaussianPrior>(std::vector<GaussianPrior::Block>{
                         {prior_bias_, prior_bias_sigma_, false}}),
                     {BiasBlock(index)});
  }
}

std::vector<int64_t> RateGroups::Unneeded(const std::set<int64_t>& needed) const {
  std::vector<int64_t> ids;
  for (auto it = groups_.begin(); it != groups_.end() && std::next(it) != groups_.end(); ++it) {
    if (needed.count(it->first) > 0) break;
    ids.push_back(it->first);
  }
  return ids;
}

std::vector<BlockId> RateGroups::BiasesOnlyOf(const std::vector<int64_t>& oldest,
                                              const FactorGraph& graph) const {
  const auto first_kept = std::next(groups_.begin(), static_cast<std::ptrdiff_t>(oldest.size()));
  std::vector<BlockId> biases;
  if (first_kept == groups_.end()) return biases;
  for (const auto& [id, block] : graph.blocks()) {
    if (id.kind == BlockKind::kBias && id.index < first_kept->second.bias_index) {
      biases.push_back(id);
    }
  }
  return biases;
}

void RateGroups::Drop(const std::vector<int64_t>& ids) {
  for (const int64_t id : ids) groups_.erase(id);
}

}  // namespace camgyro
