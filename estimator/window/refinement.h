// All pairs of a recording in one problem: the best estimate that a recorded sequence allows.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_REFINEMENT_H_
#define CAMGYRO_ESTIMATOR_WINDOW_REFINEMENT_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/result.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/fit_quality.h"
#include "estimator/window/frame_times.h"
#include "estimator/window/frame_wander.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

struct PairLatents;

struct RefinementOptions {
  PairGraphOptions graph;
  // Noise scale, directions and solve, until the estimate settles: it does so in two or three, or,
  // where the start is far off and little is determined, in up to nine
  // (FaultsTest.TheLightFlickers).
  int max_rounds = 12;
  // It has settled when a round, with its new directions, has moved the state by less than this, in
  // sigmas (Mahalanobis distance, and each parameter by itself).
  double settled_round = 0.3;
  // The scale of the noise, the pairs' factors (root mean square) and the spread of the frames'
  // times have settled when a round has changed them by less than this share. Of that size is the
  // error of all sigmas. A factor that changes by more than three times this counts as if it were
  // three times: where the model misfits, some pairs turn from one direction to another and back
  // with the noise that each of the two leaves, for ever, and tell nothing of the others.
  double settled_scale = 0.03;
  double cluster_s = 2.0;  // stretches of the clustered covariance
  // What pairs share is held (graph.hold_shared), and the frames' own times are what is asked for:
  // it is they that have to settle in a round, and there is no covariance of the calibration.
  bool frame_times_alone = false;
  // The pairs' factors are found; false: they stay as they are.
  bool find_noise_factors = true;
  // Linearisations are kept while nothing changes, from a step that is tried to its derivatives and
  // from the last step to the covariance, unless they are larger than this: those of some minutes
  // of recording. Longer ones need their memory for Ceres' copies of them.
  double most_kept_bytes = 128e6;
  // Asked after the second round and each that follows, with the estimates before and after it and
  // the scale of the noise: a fit that is lost ends there. It would take all rounds, and the
  // longest. Empty: none is.
  std::function<bool(const Calibration& before, const Calibration& now, double noise)> is_lost;
  // Of a fit that has settled, whose result and noise this one starts from; null: of none.
  std::shared_ptr<const PairLatents> latents;
};

struct Refined {
  Calibration calibration;
  FitQuality quality;
  int rounds = 0;
  bool converged = false;
  int skipped_pairs = 0;  // gyro gaps, too few matches, outside the gyro's time
  // With frame_stamp_jitter: of every frame that is in a pair, by PairGraph::FrameNumber.
  std::vector<FrameOffset> frame_times;
  LateFrames late_frames;    // among these
  FrameWander frame_wander;  // of the others
  std::shared_ptr<const PairLatents> latents;
  std::map<int64_t, double> noise_factors;  // TimedPair::noise_factor of the pairs used, by id
};

// Fits all `pairs` of the input. start: values with effects.
// Errors: kCannotEstimate if fewer than 10 pairs can be used or no solve succeeds.
Result<Refined> Refine(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                       const Calibration& start, const Prior& prior,
                       const RefinementOptions& options);

// Gives pairs the noise that a fit has found for them; those that it has not keep theirs.
void TakeNoiseFactors(const std::map<int64_t, double>& factors, std::vector<TimedPair>* pairs);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_REFINEMENT_H_
