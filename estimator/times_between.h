// The own times of frames that no pair of a fit has.
#ifndef CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_
#define CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_

#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "estimator/calibrate.h"
#include "estimator/window/frame_times.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// Own times of all frames (frame_stamp_jitter), also of those that SelectPairs leaves out: found
// from the pairs of neighbours, stretch by stretch, with lens, shutter, mounting, bias and effects
// held where the fit has them, and its times as a start. Their sigmas are those of a frame's time
// beside a calibration that is known. of_pairs: the fit's times (Refined::frame_times), which come
// back as they are where it leaves no frame out or has none, and in stretches whose neighbours
// cannot be fitted. noise_px: of the fit; graph: its options.
std::vector<FrameOffset> TimesOfAllFrames(const Recording& recording, const Calibration& fit,
                                          const std::vector<FrameOffset>& of_pairs, double noise_px,
                                          const PairGraphOptions& graph);

// By how much further apart than their sigmas say the left and the right half of the picture are in
// the times that they tell of the same frames, of stretches spread over the recording: noise in
// both, and what moves parts of the picture differently, which no sigma of a frame's time knows. 1
// where it is not more, or too few frames are told by both. Arguments as above.
double DisagreementOfSides(const Recording& recording, const Calibration& fit,
                           const std::vector<FrameOffset>& of_pairs, double noise_px,
                           const PairGraphOptions& graph);

// Both for a report, whose frame_times are of pairs before: times of all frames, with sigmas that
// know of the disagreement, and a note where there is some.
void TakeTimesOfAllFrames(const Recording& recording, const PairGraphOptions& graph,
                          CalibrationReport* report);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_TIMES_BETWEEN_H_
