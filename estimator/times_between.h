// The own times of frames that no pair of a fit has.
#ifndef CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_
#define CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_

#include <vector>

#include "core/recording.h"
#include "estimator/window/frame_times.h"
#include "estimator/window/refinement.h"

namespace camgyro {

// Own times of all frames (frame_stamp_jitter), also of those that SelectPairs leaves out: found
// from the pairs of neighbours, stretch by stretch, with lens, shutter, mounting, bias and effects
// held where `fit` has them, and its times as a start. Their sigmas are those of a frame's time
// beside a calibration that is known. options: those of the fit. Returns the times of the fit where
// it leaves no frame out or has no times, and in stretches whose neighbours cannot be fitted.
std::vector<FrameOffset> TimesOfAllFrames(const Recording& recording, const Refined& fit,
                                          const RefinementOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_
