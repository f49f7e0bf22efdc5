// When did the delay step?
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_TIME_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_TIME_H_

#include <vector>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph.h"

namespace camgyro {

// Puts every delay_step of a calibration before the frame, of those within `reach_s` of where it
// is, for which the pairs have the least chi2 with all else held; in the middle of the frames that
// are equally good (none of the pairs has them). False if nothing has moved.
// noise: of a pixel [px], of a rotation [rad] for attitudes.
bool PlaceDelaySteps(const Recording& recording, const EstimationInput& input,
                     const std::vector<TimedPair>& pairs, double reach_s, double noise,
                     const PairGraphOptions& options, Calibration* calibration);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_TIME_H_
