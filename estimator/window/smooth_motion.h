// What is a smooth function of the place in the picture, and what of each point's own.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_SMOOTH_MOTION_H_
#define CAMGYRO_ESTIMATOR_WINDOW_SMOOTH_MOTION_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// What of a pair's displacements is no smooth function of the place in the picture, as all that a
// turn, a lens, a shutter or a plane makes is: the sum of the variances of both coordinates, robust
// [px^2]. Smooth is a polynomial, of the third degree if there are matches enough (30). Of a turn
// by 0.1 rad, the fourth is less than 0.1 px at f = 650 px. Negative if there are too few for any.
double UnsmoothVariance(const std::vector<Match>& matches, const Eigen::Vector2d& size_px);

// Robust variances of what a fit leaves of a pair [px^2].
struct LeftOver {
  double all = 0.0;
  double unsmooth = 0.0;  // without what is a smooth function of the place
};

// Of a pair's corrections (MatchMisfit::correction_px [px]) at these places [px]. A correction is
// known across its epipolar line only, and so is what the smooth shift of the picture makes of it.
// Absent where there are too few for a shift of the whole picture.
std::optional<LeftOver> SeparateSmooth(const std::vector<Eigen::Vector2d>& places_px,
                                       const std::vector<Eigen::Vector2d>& corrections_px,
                                       const Eigen::Vector2d& size_px);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_SMOOTH_MOTION_H_
