// How a start asks for rotations between pictures.
#ifndef CAMGYRO_ESTIMATOR_START_CAMERA_ROTATIONS_AT_H_
#define CAMGYRO_ESTIMATOR_START_CAMERA_ROTATIONS_AT_H_

#include <functional>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Camera rotations as a recording's pictures give them in each of some trials, which are best
// sorted. About sixty in all; a few hundred pairs are enough.
using CameraRotationsAt = std::function<std::vector<std::vector<CameraRotation>>(
    const Recording& recording, const std::vector<RotationTrial>& trials)>;

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_CAMERA_ROTATIONS_AT_H_
