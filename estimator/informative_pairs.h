// Which pairs of a long recording a refinement takes, so that its time does not grow with the
// recording's.
#ifndef CAMGYRO_ESTIMATOR_INFORMATIVE_PAIRS_H_
#define CAMGYRO_ESTIMATOR_INFORMATIVE_PAIRS_H_

#include <cstddef>
#include <vector>

#include "estimator/window/estimation_input.h"

namespace camgyro {

// At most `most` of the pairs, in their order: those of the stretches of a second that tell most
// together.
//
// Everything that is calibrated shows in how the picture turns: focal length, principal point and
// mounting in the rate about each axis, delay and readout in its changes. So a stretch tells
//   H = sum over its pairs of matches * x x',   x = (rate, change of rate) of the gyro  [6]
// and stretches are taken one after the other, always the one that adds most to log det (sum of H)
// for each of its pairs: another axis counts for more than more of the same. Residuals have no say,
// so that no pair is chosen for its noise. What of the rates is bias or noise is neglected.
// delay_s: of the clocks, about. Source: Schneider et al., "Observability-aware self-calibration of
// visual and inertial sensors for ego-motion estimation", IEEE Sensors 2019, whose measure is that
// of all parameters.
std::vector<TimedPair> InformativePairs(const EstimationInput& input, double delay_s, size_t most);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_INFORMATIVE_PAIRS_H_
