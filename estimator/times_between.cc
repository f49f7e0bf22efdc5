#include "estimator/times_between.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "core/parallel.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/refinement.h"

namespace camgyro {
namespace {

// Pairs of neighbours that are fitted together. Frames' times hang together within a few frames:
// where the calibration is held, stretches need not know of each other, and each settles in fewer
// steps than all of a recording does.
constexpr size_t kStretch = 150;
// Pairs on either side that a stretch shares with the next one, so that none of its own frames is
// at an end.
constexpr size_t kShared = 10;

// Rates that pairs within some time may need, those of frames that are late by kMostSpreadS
// included [s].
constexpr double kRateMarginS = 1.0;

// Those of the pairs first, first + 1, ... before end, and their rates.
EstimationInput PartOf(const EstimationInput& input, size_t first, size_t end,
                       const Calibration& calibration) {
  EstimationInput part;
  part.origin_ns = input.origin_ns;
  part.pairs.assign(input.pairs.begin() + static_cast<std::ptrdiff_t>(first),
                    input.pairs.begin() + static_cast<std::ptrdiff_t>(end));
  const auto delay_s = [&](const TimedPair& pair) { return DelayOf(calibration, pair.first()); };
  const double from_s = part.pairs.front().time_a_s + delay_s(part.pairs.front()) - kRateMarginS;
  const double to_s = part.pairs.back().time_b_s + delay_s(part.pairs.back()) + kRateMarginS;
  for (const TimedRate& rate : input.rates) {
    if (rate.time_s >= from_s && rate.time_s <= to_s) part.rates.push_back(rate);
  }
  return part;
}

}  // namespace

std::vector<FrameOffset> TimesOfAllFrames(const Recording& recording, const Calibration& fit,
                                          const std::vector<FrameOffset>& of_pairs, double noise_px,
                                          const PairGraphOptions& graph) {
  // The calibration and the times of the frames in pairs are known; what is left are directions and
  // times: a third round moves them no nearer to the camera's clock (docs/lab/performance.md).
  constexpr int kRounds = 2;
  if (of_pairs.empty() || !SelectPairs(recording).leaves_frames_out()) return of_pairs;

  const EstimationInput input = OutlineOf(recording, PairSelection());
  auto times = std::make_shared<PairLatents>();
  std::map<int64_t, FrameOffset> all;  // by frame
  for (const FrameOffset& frame : of_pairs) {
    all[frame.frame] = frame;
    times->frame_times_s[frame.frame] = frame.offset_s;
  }
  RefinementOptions with;
  with.graph = graph;
  with.max_rounds = kRounds;
  with.frame_times_alone = with.graph.hold_shared = true;
  with.latents = std::move(times);
  with.graph.sigma = noise_px;
  // What is a frame's own moves nothing else.
  const Prior held = {fit, fit.sigma(),
                      fit.effect_covariance.diagonal().cwiseMax(1e-24).cwiseSqrt()};

  std::vector<std::vector<FrameOffset>> of_stretches((input.pairs.size() + kStretch - 1) /
                                                     kStretch);
  ParallelFor(of_stretches.size(), [&](size_t k) {
    const size_t first = k * kStretch, end = std::min(first + kStretch, input.pairs.size());
    EstimationInput part = PartOf(input, first - std::min(first, kShared),
                                  std::min(end + kShared, input.pairs.size()), fit);
    AddMatches(recording, &part.pairs);
    const Result<Refined> refined = Refine(part, part.pairs, fit, held, with);
    if (!refined) return;
    const int64_t own_from = PairGraph::FrameNumber(input.pairs[first].time_a_s);
    const int64_t own_to = PairGraph::FrameNumber(input.pairs[end - 1].time_b_s);
    for (const FrameOffset& frame : refined->frame_times) {
      if (frame.frame >= own_from && frame.frame <= own_to) of_stretches[k].push_back(frame);
    }
  });
  for (const auto& of_stretch : of_stretches) {
    for (const FrameOffset& frame : of_stretch) all[frame.frame] = frame;
  }
  std::vector<FrameOffset> result;
  for (const auto& entry : all) result.push_back(entry.second);
  return result;
}

}  // namespace camgyro
