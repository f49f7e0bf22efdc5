#include "estimator/diagnosis/step_time.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include "core/effects/catalogue.h"
#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "estimator/diagnosis/pair_scores.h"
#include "estimator/diagnosis/thresholds.h"

namespace camgyro {
namespace {

// The calibration with another shape of its effect number `at`.
Calibration WithShape(Calibration calibration, size_t at, const ShapedEffect& step) {
  auto set = std::make_shared<EffectSet>();
  const auto& items = calibration.effects->items();
  for (size_t i = 0; i < items.size(); ++i) {
    const auto& item = items[i];
    if (i == at) {
      set->Add(item.entry, step.shape, step.effect);
    } else {
      set->Add(item);
    }
  }
  calibration.effects = set;
  return calibration;
}

// Of a pair: chi2 with the step after it, between its frames, and before it.
struct PairCosts {
  double time_a_s, time_b_s;
  double after, between, before;

  double At(double step_s) const {
    return step_s > time_b_s ? after : step_s > time_a_s ? between : before;
  }
};

}  // namespace

bool PlaceDelaySteps(const Recording& recording, const EstimationInput& input,
                     const std::vector<TimedPair>& pairs, double reach_s, double noise,
                     const PairGraphOptions& options, Calibration* calibration) {
  if (calibration->effects == nullptr) return false;
  const EffectSetup setup = MakeEffectSetup(recording, *calibration);
  bool moved = false;
  for (size_t k = 0; k < calibration->effects->items().size(); ++k) {
    const auto& item = calibration->effects->items()[k];
    const std::optional<double> now_s = item.effect->first_stamp_s();
    if (!now_s || !item.entry->step_at) continue;
    std::vector<double> times_s;  // between two frames each
    for (size_t i = 1; i < setup.frames.size(); ++i) {
      const double time_s = 0.5 * (setup.frames[i - 1].stamp_s + setup.frames[i].stamp_s);
      if (std::abs(time_s - *now_s) <= reach_s) times_s.push_back(time_s);
    }
    if (times_s.empty()) continue;
    const auto chi2 = [&](const TimedPair& pair, double step_s) {
      const Calibration with = WithShape(*calibration, k, item.entry->step_at(setup, step_s));
      const Scores scores = ComputeScores(input, {{pair}}, with, nullptr, noise, options);
      return scores.pairs.empty() ? 0.0 : scores.pairs.front().chi2;
    };
    const double first_s = setup.frames.front().stamp_s + 1e-3,
                 last_s = setup.frames.back().stamp_s;
    std::vector<const TimedPair*> near;
    for (const TimedPair& pair : pairs) {
      if (pair.time_b_s < times_s.front() || pair.time_a_s > times_s.back()) continue;
      near.push_back(&pair);
    }
    std::vector<PairCosts> costs(near.size());
    ParallelFor(near.size(), [&](size_t i) {
      TimedPair pair = *near[i];
      if (pair.matches.empty()) pair.matches = MatchesOf(recording, pair);
      costs[i] = {pair.time_a_s, pair.time_b_s, chi2(pair, last_s),
                  chi2(pair, 0.5 * (pair.time_a_s + pair.time_b_s)), chi2(pair, first_s)};
    });
    double least = 0.0;
    size_t first = 0, last = 0;  // of the least
    for (size_t i = 0; i < times_s.size(); ++i) {
      double sum = 0.0;
      for (const PairCosts& pair : costs) sum += pair.At(times_s[i]);
      if (i == 0 || sum < least) {
        least = sum;
        first = last = i;
      } else if (sum == least && last + 1 == i) {
        last = i;
      }
    }
    const ShapedEffect step = item.entry->step_at(setup, times_s[(first + last) / 2]);
    if (step.shape == item.shape) continue;
    *calibration = WithShape(std::move(*calibration), k, step);
    moved = true;
  }
  return moved;
}

namespace {

constexpr int kScanHalf = static_cast<int>(kScanS / kScanStepS + 0.5);
constexpr int kDelays = 2 * kScanHalf + 1;

// A noise for which the minima of chi2 are as wide as the steps of the scan.
double ScanNoise(const std::vector<PairBlock>& blocks, double noise) {
  std::vector<double> speeds;  // of matches [px/s] or of attitudes [rad/s]
  for (const PairBlock& block : blocks) {
    for (const TimedPair& pair : block) {
      const double gap_s = pair.time_b_s - pair.time_a_s;
      if (pair.matches.empty()) {
        speeds.push_back(pair.rotation.q_a_b.angularDistance(Eigen::Quaterniond::Identity()) /
                         gap_s);
      }
      for (const Match& match : pair.matches) {
        speeds.push_back((match.px_b - match.px_a).norm() / gap_s);
      }
    }
  }
  return speeds.empty() ? noise : std::max(noise, 0.5 * kScanStepS * MedianInPlace(&speeds));
}

struct BlockCosts {
  double begin_s = 0.0, end_s = 0.0;
  int residuals = 0;
  double at[kDelays] = {};  // chi2 with each delay
  double now() const { return at[kScanHalf]; }
};

}  // namespace

std::optional<LargeStep> FindLargeStep(const EstimationInput& input,
                                       const std::vector<PairBlock>& blocks,
                                       const Calibration& calibration, double noise,
                                       const PairGraphOptions& options) {
  const double scan_noise = ScanNoise(blocks, noise);
  // Frames' own times would take a part of a step for themselves, and are searched for each delay.
  Calibration at_stamps = calibration;
  if (calibration.effects && calibration.effects->frame_time_spread() >= 0) {
    at_stamps.effect_values[calibration.effects->frame_time_spread()] = 0.0;
  }
  std::vector<BlockCosts> of_blocks(blocks.size());
  ParallelFor(blocks.size(), [&](size_t b) {
    const PairBlock& block = blocks[b];
    BlockCosts& cost = of_blocks[b];
    const size_t stride = (block.size() + kScanPairs - 1) / kScanPairs;
    for (size_t i = 0; i < block.size(); i += stride) {
      const auto scores_at = [&](double delay_s) {
        Calibration with = at_stamps;
        with.delay_s = delay_s;
        return ComputeScores(input, {{block[i]}}, with, nullptr, scan_noise, options);
      };
      const Scores now = scores_at(calibration.delay_s);
      if (now.pairs.empty()) continue;
      cost.residuals += now.pairs.front().residuals;
      for (int k = 0; k < kDelays; ++k) {
        const Scores scores = scores_at(calibration.delay_s + (k - kScanHalf) * kScanStepS);
        // Where the gyro's samples end, a delay says nothing.
        cost.at[k] += (scores.pairs.empty() ? now : scores).pairs.front().chi2;
      }
    }
    if (cost.residuals == 0) return;
    cost.begin_s = block.front().time_a_s;
    cost.end_s = block.back().time_b_s;
  });
  std::vector<BlockCosts> costs;
  std::copy_if(of_blocks.begin(), of_blocks.end(), std::back_inserter(costs),
               [](const BlockCosts& cost) { return cost.residuals > 0; });
  if (costs.size() < kLeastBlocks) return std::nullopt;
  std::vector<double> misfits;
  for (const BlockCosts& block : costs) misfits.push_back(block.now() / block.residuals);
  std::sort(misfits.begin(), misfits.end());
  const double good = misfits[misfits.size() / 4];
  double excess = 0.0;
  for (const BlockCosts& block : costs) {
    excess += std::max(0.0, block.now() - good * block.residuals);
  }
  LargeStep best;
  double most = 0.0;
  for (size_t border = 1; border < costs.size(); ++border) {
    double before[kDelays] = {}, after[kDelays] = {};
    for (size_t b = 0; b < costs.size(); ++b) {
      for (int k = 0; k < kDelays; ++k) {
        (b < border ? before : after)[k] += costs[b].now() - costs[b].at[k];
      }
    }
    for (int k = 0; k < kDelays; ++k) {
      const double change_s = (k - kScanHalf) * kScanStepS;
      const double time_s = 0.5 * (costs[border - 1].end_s + costs[border].begin_s);
      if (before[k] > most) {
        most = before[k];
        best = {time_s, calibration.delay_s + change_s, -change_s, most / excess};
      }
      if (after[k] > most) {
        most = after[k];
        best = {time_s, calibration.delay_s, change_s, most / excess};
      }
    }
  }
  if (!(most > 0.0) || !(excess > 0.0)) return std::nullopt;
  return best;
}

}  // namespace camgyro
