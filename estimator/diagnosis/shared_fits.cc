#include "estimator/diagnosis/shared_fits.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "estimator/astray.h"
#include "estimator/diagnosis/step_time.h"
#include "estimator/diagnosis/thresholds.h"
#include "estimator/window/settle_effects.h"

namespace camgyro {

namespace {

EstimationInput OutlineWithNoise(const LoopInput& in) {
  EstimationInput outline = OutlineOf(*in.recording, SelectPairsToTest(*in.recording));
  TakeNoiseFactors(in.noise_factors, &outline.pairs);
  return outline;
}

}  // namespace

SharedFits::SharedFits(const LoopInput& in, const DiagnoseOptions& options)
    : in_(in),
      options_(options),
      input_(OutlineWithNoise(in)),
      shares_(
          MakeShares(*in.recording, input_, {kMostFitPairs, kMostChoicePairs, kMostReportPairs})) {
  const auto shares_of = [&](const PairSelection& selection, const ShareLimits& limits) {
    return MakeShares(*in.recording, OutlineOf(*in.recording, selection), limits);
  };
  const bool reanchored = in.recording->match_noise == MatchNoise::kSecondImage;
  const PairSelection near = SelectPairs(*in.recording, {reanchored ? kNearestGap : kNearGap});
  map_pairs_ = shares_of(near, {kMostFitPairs, kMostChoicePairs, 0, /*with_report=*/false}).choice;
  if (in.recording->HasOnlyAttitudes()) return;
  // So that no two of them share noise: as far apart as the others, and where a tracker re-anchors,
  // one after the other.
  const int stride = reanchored ? kNearestGap : SelectPairsToTest(*in.recording).stride;
  const Shares nearest =
      shares_of({kNearestGap, stride}, {kMostFitPairs, kMostFitPairs, 0, /*with_report=*/false});
  near_pairs_ = Joined(nearest.fit);
  const std::vector<TimedPair> choice = Joined(nearest.choice);
  near_pairs_.insert(near_pairs_.end(), choice.begin(), choice.end());
}

std::vector<PairBlock> SharedFits::SeenBlocks() const {
  std::vector<PairBlock> blocks;
  for (const auto* share : {&shares_.fit, &shares_.choice}) {
    std::copy_if(share->begin(), share->end(), std::back_inserter(blocks),
                 [](const PairBlock& block) { return !block.empty(); });
  }
  std::sort(blocks.begin(), blocks.end(), [](const PairBlock& a, const PairBlock& b) {
    return a.front().time_a_s < b.front().time_a_s;
  });
  return blocks;
}

Result<Refined> SharedFits::Fit(const Calibration& start, double noise,
                                std::shared_ptr<const PairLatents> latents,
                                double most_noise) const {
  RefinementOptions refinement = options_.calibrate.refinement;
  refinement.graph = in_.graph;
  refinement.graph.sigma = noise;
  refinement.cluster_s = shares_.block_s;
  refinement.max_rounds = kFitRounds;
  refinement.latents = std::move(latents);
  refinement.is_lost = [&](const Calibration& before, const Calibration& now, double scale) {
    return scale > most_noise ||
           IsRunningAway(before.lens[kFocal], now.lens[kFocal], in_.start.lens[kFocal]);
  };
  return Refine(input_, Joined(shares_.fit), start, in_.prior, refinement);
}

Refined SharedFits::Settle(Refined fit) const {
  return SettleEffects(*in_.recording, std::move(fit), [this](const Refined& from) {
    return Fit(from.calibration, from.quality.noise_px, from.latents);
  });
}

bool SharedFits::PlaceSteps(double noise, Calibration* calibration) const {
  std::vector<TimedPair> pairs = Joined(shares_.fit);
  const std::vector<TimedPair> choice = Joined(shares_.choice);
  pairs.insert(pairs.end(), choice.begin(), choice.end());
  return PlaceDelaySteps(*in_.recording, input_, pairs, kStepMarginBlocks * shares_.block_s, noise,
                         in_.graph, calibration);
}

Scores SharedFits::ScoresOf(const std::vector<PairBlock>& blocks, const Calibration& calibration,
                            std::shared_ptr<const EffectSet> candidates, double noise) const {
  return ComputeScores(input_, blocks, calibration, std::move(candidates), noise, in_.graph);
}

bool SharedFits::HasRunAway(const Calibration& c) const {
  const LensParameters& start = in_.start.lens;
  return std::abs(c.lens[kFocal] / start[kFocal] - 1.0) > kAstrayFocal ||
         std::hypot(c.lens[kCx] - start[kCx], c.lens[kCy] - start[kCy]) >
             kAstrayCentre * std::hypot(c.width_px, c.height_px);
}

double Chi2Of(const Scores& scores) {
  double chi2 = 0.0;
  for (const BlockScore& block : scores.blocks) chi2 += block.chi2;
  return chi2;
}

std::vector<double> Fall(const Scores& before, const Scores& after) {
  std::vector<double> fall;
  for (const BlockScore& b : before.blocks) {
    for (const BlockScore& a : after.blocks) {
      if (a.time_s == b.time_s && a.pairs == b.pairs) {
        fall.push_back(b.chi2 + b.log_det - a.chi2 - a.log_det);
      }
    }
  }
  return fall;
}

}  // namespace camgyro
