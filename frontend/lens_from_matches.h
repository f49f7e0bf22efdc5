// How much a lens bends straight lines, from matches alone: no gyro, no focal length.
#ifndef CAMGYRO_FRONTEND_LENS_FROM_MATCHES_H_
#define CAMGYRO_FRONTEND_LENS_FROM_MATCHES_H_

#include <optional>

#include "core/recording.h"

namespace camgyro {

struct LensFromMatches {
  double lambda = 0.0;  // DivisionLens
  double sigma = 0.0;   // by leaving out a tenth of the recording at a time (jackknife)
};

// The lens through which the matches of some 40 pairs of frames, 0.3 s apart where there are
// tracks, lie nearest to epipolar lines (EpipolarCorrections): the mean over pairs of the logarithm
// of what they are off, robust, in pixels of the picture as it is. A rolling shutter bends them as
// well, but with every motion in another way. Between -0.8 and 0.8; the centre is the declared
// principal point, or that of the picture. Nothing where fewer than half of the pairs have enough
// matches, or where no lens in this range is better than its neighbours.
std::optional<LensFromMatches> FindLensFromMatches(const Recording& recording);

// Its lambda where it is strong beyond doubt, more than 0.05 (a twentieth, at the corner) and 5
// sigmas, and nothing declares a distortion; else 0. What makers leave of a lens that they correct
// is a fifth of that (core/effects/device_class.cc), and what a rolling shutter or a lens that
// moves makes of the matches less than half (docs/lab/lens_from_matches.md).
double StrongLensFromMatches(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_LENS_FROM_MATCHES_H_
