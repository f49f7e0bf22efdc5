#include "estimator/times_between.h"

#include <memory>
#include <utility>

#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph.h"

namespace camgyro {

std::vector<FrameOffset> TimesOfAllFrames(const Recording& recording, const Refined& fit,
                                          const RefinementOptions& options,
                                          const PairLimits& limits) {
  // Of the calibration's sigmas: what is a frame's own moves nothing else.
  constexpr double kHeld = 1e-3;
  // The calibration and the times of the frames in pairs are known; what is left are directions and
  // times, for which two rounds of search and solve do.
  constexpr int kRounds = 2;
  const PairSelection selection = SelectPairs(recording);
  if (fit.frame_times.empty() || !selection.leaves_frames_out()) return fit.frame_times;

  const EstimationInput input = OutlineOf(recording, PairSelection());
  std::vector<TimedPair> pairs =
      InformativePairs(input, fit.calibration.delay_s, limits, options.graph);
  AddMatches(recording, &pairs);
  auto times = std::make_shared<PairLatents>();
  times->frame_times_s = fit.latents->frame_times_s;
  RefinementOptions with = options;
  with.max_rounds = kRounds;
  with.latents = std::move(times);
  with.graph.sigma = fit.quality.noise_px;
  const Prior held = {fit.calibration, kHeld * fit.calibration.sigma()};
  const Result<Refined> all = Refine(input, pairs, fit.calibration, held, with);
  return all ? all->frame_times : fit.frame_times;
}

}  // namespace camgyro
