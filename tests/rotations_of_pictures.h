// Camera rotations from a recording's pictures, as the command line makes them.
#ifndef CAMGYRO_TESTS_ROTATIONS_OF_PICTURES_H_
#define CAMGYRO_TESTS_ROTATIONS_OF_PICTURES_H_

#include <vector>

#include "estimator/start/focal_scan.h"
#include "frontend/camera_rotations.h"

namespace camgyro {

// most_pairs: of frames, that have a rotation.
inline CameraRotationsAt RotationsOfPictures(const Recording& recording, int most_pairs) {
  return [pairs = PairsForRotations(recording, most_pairs)](
             const Recording& now, const std::vector<RotationTrial>& trials) {
    return CameraRotationsOf(now, pairs, trials);
  };
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_ROTATIONS_OF_PICTURES_H_
