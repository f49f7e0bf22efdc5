// The camera as far as a recording tells of it, before any estimation.
#ifndef CAMGYRO_CORE_KNOWN_CAMERA_H_
#define CAMGYRO_CORE_KNOWN_CAMERA_H_

#include <vector>

#include "core/calibration.h"
#include "core/recording.h"

namespace camgyro {

// Size, lens and distortion as declared, with this focal length; the centre of the picture where
// no principal point is declared. All else as a calibration begins.
Calibration DeclaredCamera(const CameraGuess& camera, double focal_px);

// The same through the lens that the matches show, where nothing declares its distortion and they
// have shown one (CameraGuess::division_lambda).
Calibration KnownCamera(const CameraGuess& camera, double focal_px);

// Matches as a pinhole with the camera's focal length would show them; those where the lens has no
// ray are left out.
std::vector<Match> ThroughPinhole(const Calibration& camera, const std::vector<Match>& matches);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_KNOWN_CAMERA_H_
