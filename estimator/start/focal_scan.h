// Start with an unknown focal length: a scan of the field of view.
#ifndef CAMGYRO_ESTIMATOR_START_FOCAL_SCAN_H_
#define CAMGYRO_ESTIMATOR_START_FOCAL_SCAN_H_

#include <functional>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/start/find_start.h"

namespace camgyro {

// Camera rotations of a recording as its pictures give them for a focal length [px]. Called about
// thirty times; a few hundred pairs are enough.
using CameraRotationsAtFocals =
    std::function<std::vector<std::vector<CameraRotation>>(const std::vector<double>& focals_px)>;

struct FocalScanOptions {
  // Of the picture's longer side: 0.4 is a full field of view of 103 deg, 1.8 of 31 deg.
  double min_focal = 0.4;
  double max_focal = 1.8;
  int points = 22;  // logarithmic; 7 % apart
};

// The gyro measures angles, the picture measures pan and tilt as angle times focal length (roll
// without): the focal length whose pan and tilt fit the gyro best. The residual, in pixels, is
// truncated at 3 sigma, its minimum refined by a parabola in log f; sigma from the parabola and
// from how blocks of time disagree. Then FindStart at that focal length, with `focal` set. If
// the motion does not tell (roll only, hardly any rotation) or the lens distorts so much that the
// minimum is shallow, focal->determined is false, a note says so, and the recording's guess is
// used, or 0.85 of the longer side without one.
Result<StartResult> FindStartAndFocal(const Recording& recording,
                                      const CameraRotationsAtFocals& rotations_at,
                                      const StartOptions& options,
                                      const FocalScanOptions& scan_options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_FOCAL_SCAN_H_
