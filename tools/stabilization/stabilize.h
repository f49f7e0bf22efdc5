// A rolling-shutter video rectified and stabilised with its calibration.
#ifndef CAMGYRO_TOOLS_STABILIZATION_STABILIZE_H_
#define CAMGYRO_TOOLS_STABILIZATION_STABILIZE_H_

#include <functional>
#include <optional>
#include <string>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "tools/stabilization/registration.h"

namespace camgyro {

// Where the view would go beyond the recorded picture.
enum class BorderPolicy {
  kAvoid,  // it stays behind: between the smooth orientation and the camera's own
  kBlack,
  kStretch,  // the picture's edge goes on
  kMirror,
};

struct StabilizeOptions {
  double smooth_s = 0.5;  // SmoothOrientations; 0: rectify only
  double zoom = 1.25;     // of the view; 1: the recorded field of view
  BorderPolicy border = BorderPolicy::kAvoid;
  bool side_by_side = false;  // the recorded picture to the left of the stabilised one
  int crf = 18;
};

struct StabilizeReport {
  int frames = 0;          // written
  int frames_dropped = 0;  // at the ends, outside of the gyro's time
  int width_px = 0, height_px = 0;
  double border_share = 0.0;  // of the frames, in which some border shows
  int pairs = 0;              // registered
  RegistrationError as_recorded, calibrated;
  std::optional<RegistrationError> unsynchronised;  // with t_d = t_r = 0
  std::string sound;
  double seconds = 0.0;        // decoding, warping, encoding
  double video_seconds = 0.0;  // between the first and the last frame
};

// Writes the video; `container` as VideoWriter::Open. Errors: of the files; kBadInput if the
// recording has no pictures, these are not of the calibration's size, or no two frames lie within
// the gyro's time.
Result<StabilizeReport> Stabilize(const Recording& recording, const Calibration& calibration,
                                  const StabilizeOptions& options, const std::string& file,
                                  const std::string& container,
                                  const std::function<void(double done)>& progress);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_STABILIZATION_STABILIZE_H_
