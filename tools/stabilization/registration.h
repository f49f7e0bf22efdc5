// How well neighbouring frames lie on each other: the gain of a stabilised video as a number.
#ifndef CAMGYRO_TOOLS_STABILIZATION_REGISTRATION_H_
#define CAMGYRO_TOOLS_STABILIZATION_REGISTRATION_H_

#include <optional>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "tools/stabilization/camera_path.h"

namespace camgyro {

// Median distances of matched points of neighbouring frames [px of the recording, zoom 1].
struct RegistrationError {
  // Both frames seen from one orientation (of the first frame's middle row): what shakes.
  double turned_px = 0.0;
  // After the best homography between the frames: what bends and wobbles.
  double homography_px = 0.0;
};

// Of the pictures as they were recorded: turned_px is the plain distance.
RegistrationError RegisterAsRecorded(const std::vector<FramePair>& pairs);

// Of pictures rectified with a calibration. Nothing if none of the frames is within the gyro's
// time with this calibration's delay.
std::optional<RegistrationError> RegisterRectified(const Recording& recording,
                                                   const Calibration& calibration,
                                                   const std::vector<FramePair>& pairs);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_STABILIZATION_REGISTRATION_H_
