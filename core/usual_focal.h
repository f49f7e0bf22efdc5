// The focal length to begin with where nothing declares one.
#ifndef CAMGYRO_CORE_USUAL_FOCAL_H_
#define CAMGYRO_CORE_USUAL_FOCAL_H_

#include <algorithm>

#include "core/recording.h"

namespace camgyro {

// Of the picture's longer side: a field of view of 61 degrees along it, that of a phone's main
// camera (26 mm on 35 mm film, 69 degrees) less what stabilisation crops from a video.
constexpr double kUsualFocal = 0.85;

// The declared focal length, else the usual one [px].
inline double FocalToBeginWith(const CameraGuess& camera) {
  return camera.focal_px.value_or(kUsualFocal * std::max(camera.width_px, camera.height_px));
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_USUAL_FOCAL_H_
