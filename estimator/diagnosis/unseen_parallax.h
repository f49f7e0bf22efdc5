// Far things, all at about one distance: a step sideways shifts their picture as a turn does.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_UNSEEN_PARALLAX_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_UNSEEN_PARALLAX_H_

#include <vector>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// The name of its share in CalibrationReport::systematic.
constexpr char kUnseenParallax[] = "unseen_parallax";

// How fast a turn about the camera's x or y axis may be that a fit takes for parallax, or parallax
// for it [rad/s], as a standard deviation. Where parallaxes within a pair of frames differ by much
// more than the noise, they tell a step from a turn; where they do not, the points' noise hides a
// common shift that is as large as itself, and a longer pair hides a larger one. With sigma the
// noise of a displacement, s the spread of the parallaxes over it (UnsmoothVariance), f and T focal
// length and time between the frames, that is
//   kHiddenShift sigma / f / max(min(T, kUsualGapS), s^2 T)
// of which the median over the pairs counts. The shift is one of all pairs, since somebody who
// walks goes one way: it does not average out. `pairs` have their matches; those whose residual has
// no direction count for nothing. noise_px: of a point. Measured: docs/lab/pairs.md.
double UnseenParallax(const std::vector<TimedPair>& pairs, const Calibration& calibration,
                      double noise_px, const PairGraphOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_UNSEEN_PARALLAX_H_
