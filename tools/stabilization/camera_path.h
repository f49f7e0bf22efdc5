// The camera's orientation over time by the gyro, and a smoother one to look from.
#ifndef CAMGYRO_TOOLS_STABILIZATION_CAMERA_PATH_H_
#define CAMGYRO_TOOLS_STABILIZATION_CAMERA_PATH_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "core/rotation_chain.h"

namespace camgyro {

// Orientations R_world_cam: camera vectors into a frame that does not turn (the gyro frame at the
// first sample). The integrated gyro, bias removed.
class CameraPath {
 public:
  // `recording` has at least two gyro samples. Copies what it needs.
  CameraPath(const Recording& recording, const Calibration& calibration);

  // When a row of a frame was exposed, on the gyro's clock from its first sample [s].
  double RowTime(int frame, double row_px) const;
  // By how much the lens differs from the calibration's while a row is exposed: by those of the
  // calibration's effects that move it.
  LensParameters LensChange(int frame, double row_px) const;
  Eigen::Matrix3d R_world_cam(double time_s) const;
  Eigen::Matrix3d R_world_cam(int frame, double row_px) const {
    return R_world_cam(RowTime(frame, row_px));
  }

  // Is every row of the frame within the gyro's time?
  bool Covers(int frame) const;
  // Frames first..last that are covered; first > last if none is.
  int first_frame() const { return first_frame_; }
  int last_frame() const { return last_frame_; }

 private:
  std::vector<double> frame_times_s_;  // stamps, camera clock, from the first gyro sample
  Calibration calibration_;
  Eigen::Matrix3d R_gyro_cam_;
  RotationChain chain_;
  int first_frame_ = 0, last_frame_ = -1;
};

// Is the calibration one of this recording's camera and clocks? kBadInput if pictures have another
// size than it was made for, or no two frames lie within the gyro's time.
Status CheckCalibrationFits(const Recording& recording, const Calibration& calibration,
                            const CameraPath& path);

// One orientation for each frame first..last of the path: that of its middle row, averaged over
// time with a Gaussian of this standard deviation. 0: as it is. Turning at a constant rate stays as
// it is too; at the ends the average is over what there is.
std::vector<Eigen::Quaterniond> SmoothOrientations(const CameraPath& path, double middle_row_px,
                                                   double smooth_s);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_STABILIZATION_CAMERA_PATH_H_
