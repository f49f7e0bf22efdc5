// Camera rotations of a recording at a trial focal length: what the start asks for.
#ifndef CAMGYRO_FRONTEND_CAMERA_ROTATIONS_H_
#define CAMGYRO_FRONTEND_CAMERA_ROTATIONS_H_

#include <vector>

#include "core/recording.h"

namespace camgyro {

struct RotationPairOptions {
  // Time between the two frames of a pair. Rotation grows with it, noise does not, but matches get
  // lost. docs/track.md has the measurement.
  double interval_s = 0.08;
};

// Pairs of frames for rotations, each starting where the one before ends: from tracks, about
// interval_s apart; from matches, as they are. Empty without image motion.
std::vector<FramePair> PairsForRotations(const Recording& recording,
                                         const RotationPairOptions& options = {});

// At most `max_pairs` of them, evenly spread.
std::vector<FramePair> SpreadPairs(const std::vector<FramePair>& pairs, size_t max_pairs);

// EstimateCameraRotation (two_view_rotation.h) of each pair with the recording's declared lens (the
// centre of the picture where it declares no principal point), and this focal length [px]. Pairs
// whose rotation cannot be found are left out.
std::vector<CameraRotation> CameraRotationsOf(const std::vector<FramePair>& pairs,
                                              const CameraGuess& camera, double focal_px);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_CAMERA_ROTATIONS_H_
