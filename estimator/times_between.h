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
// known. options: those of the fit. limits: of the pairs of neighbours. Returns the times of the
// fit where it has none, leaves no frame out, or the fit of the neighbours fails.
std::vector<FrameOffset> TimesOfAllFrames(const Recording& recording, const Refined& fit,
                                          const RefinementOptions& options,
                                          const PairLimits& limits);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_
