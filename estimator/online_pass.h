// The sliding window over a recording, in the order of real time.
#ifndef CAMGYRO_ESTIMATOR_ONLINE_PASS_H_
#define CAMGYRO_ESTIMATOR_ONLINE_PASS_H_

#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/calibrate.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_selection.h"
#include "estimator/window/sliding_window.h"

namespace camgyro {

// Feeds a window with a recording as a device would: a sample is known when its time has come, a
// frame at its stamp. The recording and its input outlive it.
class OnlinePass {
 public:
  // input: of the recording, an outline is enough. selection: of the pairs, those of input are not
  // taken. start: values with effects.
  OnlinePass(const Recording& recording, const EstimationInput& input,
             const PairSelection& selection, const Calibration& start, const Prior& prior,
             const SlidingWindowOptions& options);
  OnlinePass(const OnlinePass&) = delete;
  OnlinePass& operator=(const OnlinePass&) = delete;

  // Until the window has been settled for kSettledPairs pairs: from there on, its estimate is as
  // good a start for a fit of all pairs as that of its end. To the end if it never settles.
  // Errors: kBadInput for stamps that step back and for numbers that are not finite.
  static constexpr int kSettledPairs = 100;
  Status RunUntilSettled(const Progress& progress);
  // The rest.
  Status Finish();

  const SlidingWindow& window() const { return window_; }
  bool has_estimate() const { return !trace_.empty(); }
  // Every update so far; gives them away.
  std::vector<WindowUpdate> TakeTrace() {
    trace_.shrink_to_fit();  // of an hour, 41 of 74 MB are used
    return std::move(trace_);
  }

 private:
  // The next pair, with the samples before it.
  Status Next();
  Status FeedGyro(double until_s);

  const Recording& recording_;
  const EstimationInput& input_;
  const Calibration start_;
  const std::vector<TimedPair> pairs_;
  SlidingWindow window_;
  std::vector<WindowUpdate> trace_;
  size_t next_pair_ = 0, next_sample_ = 0;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ONLINE_PASS_H_
