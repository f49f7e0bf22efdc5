// A rolling-shutter recording as a camera with a global shutter on the gyro's clock would have made
// it.
#ifndef CAMGYRO_TOOLS_STABILIZATION_RECTIFY_H_
#define CAMGYRO_TOOLS_STABILIZATION_RECTIFY_H_

#include <functional>
#include <string>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

struct RectifyOptions {
  bool undistort = false;    // pixels of a pinhole with the same focal length and principal point
  bool remove_bias = false;  // from the rates
};

struct Rectified {
  // Frames have the time of their middle row on the gyro's clock, tracked points are where they
  // were seen at that time. What left the picture by that is dropped, and so are frames that the
  // gyro does not cover. Frame::image_file is the name that RectifyPictures gives to it.
  Recording recording;
  // t_d = t_r = 0, and without distortion or bias if these were taken out.
  Calibration calibration;
  int first_frame = 0;  // of the recording that was rectified
  int frames_dropped = 0;
  double shift_px = 0.0;  // by which tracked points were moved: root mean square; 0 without tracks
};

// Only rotation is undone: what the camera moves while a picture is read out stays in it. Errors:
// kBadInput if the recording has neither pictures nor tracks, is of another size than the
// calibration, or no two frames lie within the gyro's time. The recording's tracks are taken away
// (of an hour they are half a gigabyte): there are none left after success.
Result<Rectified> Rectify(const Calibration& calibration, const RectifyOptions& options,
                          Recording* recording);

// The pictures of Rectify's result, 8-bit grey, as files of their names in `folder`, which has to
// exist; black where nothing was recorded. Errors: kBadInput for pictures that cannot be read or
// written.
Status RectifyPictures(const Recording& recording, const Calibration& calibration,
                       const Rectified& rectified, const std::string& folder,
                       const std::function<void(double done)>& progress);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_STABILIZATION_RECTIFY_H_
