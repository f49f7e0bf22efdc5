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

// The lens, behind the declared one, through which the matches of some 40 pairs of frames, 0.3 s
// apart where there are tracks, lie nearest to epipolar lines (EpipolarCorrections): the mean over
// pairs of the logarithm of what they are off, robust, in pixels of the picture as it is. A rolling
// shutter bends them as well, but with every motion in another way. Between -0.75 and 0.75; the
// centre is the declared principal point, or that of the picture. Nothing where fewer than half of
// the pairs have enough matches, or where no lens in this range is better than its neighbours.
std::optional<LensFromMatches> FindLensFromMatches(const Recording& recording);

// Puts its lambda into the camera (CameraGuess::division_lambda), where it is more than 0.03 and 5
// sigmas, else 0. What makers leave of a lens that they correct is a third of that
// (core/effects/device_class.cc); rolling shutters, noise and wrong matches have made less of it in
// all of 48 simulated recordings (docs/lab/lens_from_matches.md). A declared distortion, with a
// declared focal length, that leaves so much is that of another camera: the fault
// "declared_distortion", and it is left out.
void TakeLensFromMatches(Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_LENS_FROM_MATCHES_H_
