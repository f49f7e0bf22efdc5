// The own times of frames that no pair of a fit has.
#ifndef CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_
#define CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_

#include <vector>

#include "core/recording.h"
#include "estimator/informative_pairs.h"
#include "estimator/window/frame_times.h"
#include "estimator/window/refinement.h"

namespace camgyro {

// Own times of all frames (frame_stamp_jitter), also of those that SelectPairs leaves out: found
// from the pairs of neighbours, with lens, shutter, mounting and bias held where `fit` has them,
// and its times as a start. Their sigmas are those of a frame's time beside a calibration that is
// known. limits: of the pairs of neighbours. Those of the fit where it has no frame times, leaves
// none out, or cannot be continued.
// options: those of the fit.
std::vector<FrameOffset> TimesOfAllFrames(const Recording& recording, const Refined& fit,
                                          const RefinementOptions& options,
                                          const PairLimits& limits);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_
