#include "estimator/online_pass.h"

#include <string>
#include <utility>

namespace camgyro {

OnlinePass::OnlinePass(const Recording& recording, const EstimationInput& input,
                       const PairSelection& selection, const Calibration& start, const Prior& prior,
                       const SlidingWindowOptions& options)
    : recording_(recording),
      input_(input),
      start_(start),
      pairs_(SideBySide(recording, selection)),
      window_(start, prior, input.origin_ns, WindowOptionsFor(selection, options)) {
  window_.SetListener([this](const WindowUpdate& update) { trace_.push_back(update); });
}

Status OnlinePass::RunUntilSettled(const Progress& progress) {
  int settled = 0;
  while (next_pair_ < pairs_.size() && settled < kSettledPairs) {
    if (progress && next_pair_ % 20 == 0) {
      progress("window", static_cast<double>(next_pair_) / static_cast<double>(pairs_.size()));
    }
    if (const Status fed = Next(); !fed) return fed;
    if (window_.latest().settled) ++settled;
  }
  return next_pair_ < pairs_.size() ? Status() : Finish();
}

Status OnlinePass::Finish() {
  while (next_pair_ < pairs_.size()) {
    if (const Status fed = Next(); !fed) return fed;
  }
  return FeedGyro(std::numeric_limits<double>::infinity());
}

Status OnlinePass::Next() {
  const TimedPair& pair = pairs_[next_pair_++];
  if (const Status fed = FeedGyro(pair.time_b_s + DelayOf(start_, pair.second())); !fed) return fed;
  if (window_.AddPair(recording_.frames[static_cast<size_t>(pair.frame_a)].stamp_ns,
                      recording_.frames[static_cast<size_t>(pair.frame_b)].stamp_ns,
                      MatchesOf(recording_, pair), pair.exposure_a_s,
                      pair.exposure_b_s) != AddResult::kAccepted) {
    return BadInput("frames " + std::to_string(pair.frame_a) + " and " +
                    std::to_string(pair.frame_b) +
                    ": the stamp repeats or goes back, or a pixel is not finite");
  }
  return {};
}

Status OnlinePass::FeedGyro(double until_s) {
  for (; next_sample_ < input_.rates.size() && input_.rates[next_sample_].time_s <= until_s;
       ++next_sample_) {
    if (window_.AddGyroSample(recording_.gyro[next_sample_],
                              input_.rates[next_sample_].saturated) != AddResult::kAccepted) {
      return BadInput("gyro sample " + std::to_string(next_sample_) +
                      ": the stamp repeats or goes back, or a rate is not finite");
    }
  }
  return {};
}

}  // namespace camgyro
