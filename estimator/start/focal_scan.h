// Start with an unknown focal length and readout time: scans of both.
#ifndef CAMGYRO_ESTIMATOR_START_FOCAL_SCAN_H_
#define CAMGYRO_ESTIMATOR_START_FOCAL_SCAN_H_

#include "core/recording.h"
#include "core/result.h"
#include "estimator/start/camera_rotations_at.h"
#include "estimator/start/find_start.h"

namespace camgyro {

struct FocalScanOptions {
  // Of the picture's longer side: 0.4 is a full field of view of 103 deg, 1.8 of 31 deg. Where the
  // longest is the best, the scan goes on as far as that gets better, to a tele lens of 8 deg.
  double min_focal = 0.4;
  double max_focal = 1.8;
  double longest_focal = 7.0;
  int points = 22;  // logarithmic; 7 % apart
  // Readout times tried, as parts of the frame interval, of both signs (a picture that was turned
  // by half a turn has its last row read first). Phones that need all of it are common, and a
  // minimum is only told from a slope with points on both sides.
  double max_readout = 1.25;
  int readouts = 11;
};

// The gyro measures angles, the picture measures pan and tilt as angle times focal length (roll
// without): the focal length whose pan and tilt fit the gyro best. The residual, in pixels, is
// truncated at 3 sigma, its minimum refined by a parabola in log f; sigma from the parabola and
// from how blocks of time disagree. Then FindStart at that focal length, with `focal` set. If
// the motion does not tell (roll only, hardly any rotation), not even how the camera's axes lie on
// the gyro's, or the lens distorts so much that the minimum is shallow, focal->determined is false,
// a note says so, and the recording's guess is used, or 0.85 of the longer side without one.
//
// All rotations but the first, which say how the gyro lies to the camera, are made with what is
// known of that (RotationTrial::rough). The readout time, where the recording does not declare it,
// is the one with which they fit the gyro best, found likewise at the best focal length of a first
// scan, and used in a second one.
//
// What explains less than kWellExplained is held against a start through a tele lens, which is
// scanned from max_focal to longest_focal, if that explains distinctly more.
//
// Last comes LookForStabiliser (stabiliser_search.h).
Result<StartResult> FindStartAndFocal(const Recording& recording,
                                      const CameraRotationsAt& rotations_at,
                                      const StartOptions& options,
                                      const FocalScanOptions& scan_options);

// The same; where the scan finds none that it can trust, at the usual focal length that explains
// the gyro best, which is then left open. Errors: of the scan.
Result<StartResult> FindStartFromPictures(const Recording& recording,
                                          const CameraRotationsAt& rotations_at,
                                          const StartOptions& options,
                                          const FocalScanOptions& scan = {});

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_FOCAL_SCAN_H_
