// Which pairs of a long recording a refinement takes, so that its time does not grow with the
// recording's.
#ifndef CAMGYRO_ESTIMATOR_INFORMATIVE_PAIRS_H_
#define CAMGYRO_ESTIMATOR_INFORMATIVE_PAIRS_H_

#include <cstddef>
#include <limits>
#include <vector>

#include "core/recording.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// What a refinement may take.
struct PairLimits {
  size_t pairs = std::numeric_limits<size_t>::max();
  double bytes = std::numeric_limits<double>::infinity();  // sum of RefinementBytes
};

// What a pair takes of memory in a refinement, about: for each match its residual's derivatives, by
// what all pairs share, by the pair's direction and bend, and by the rates of the gyro from its
// first row to its last, twice, since Ceres appends the damping of a step to a copy of them; half
// of the products of these columns with each other, in the normal equations and in their factor;
// and each match some times. (docs/lab/performance.md has what was measured.)
double RefinementBytes(const TimedPair& pair, const PairGraphOptions& options);

// What a recording takes of memory with its outline, about.
double BytesOf(const Recording& recording);

// Pairs within the limits, in their order: those of the stretches of a second that tell most
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
std::vector<TimedPair> InformativePairs(const EstimationInput& input, double delay_s,
                                        const PairLimits& limits,
                                        const PairGraphOptions& options = {});

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_INFORMATIVE_PAIRS_H_
