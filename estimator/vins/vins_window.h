// The stretch of a recording that a VIO starts from, with every observation at its own row's time.
#ifndef CAMGYRO_ESTIMATOR_VINS_VINS_WINDOW_H_
#define CAMGYRO_ESTIMATOR_VINS_VINS_WINDOW_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/calibration.h"
#include "core/imu_integral.h"
#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// What came from the sensors, and the calibration that relates them.
struct VinsInput {
  // Values; its covariance, the total one where it is known, is the prior of the refinement.
  Calibration calibration;
  std::vector<int64_t> frame_stamps_ns;           // camera clock, increasing
  std::vector<std::vector<TrackedPoint>> tracks;  // one entry per frame, by ascending track id
  std::vector<GyroSample> gyro;                   // covers the frames on the gyro's clock
  std::vector<AccelSample> accel;                 // the same clock; empty: no accelerometer
};

// The frames of a recording with first_s <= time <= last_s after its first frame, and the inertial
// samples that they need.
VinsInput CutVinsInput(const Recording& recording, const Calibration& calibration, double first_s,
                       double last_s);

struct VinsKeyframe {
  int frame = 0;        // index into VinsInput::frame_stamps_ns
  double time_s = 0.0;  // exposure of the middle row, gyro clock, from VinsWindow::origin_ns
  Eigen::Quaterniond q_world_gyro = Eigen::Quaterniond::Identity();  // by the gyro
};

struct VinsObservation {
  int landmark = 0;
  int keyframe = 0;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  double time_s = 0.0;                                         // exposure of its row
  RayJet ray;                                                  // camera frame
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitZ();  // unit
};

// World frame: the gyro frame at the first keyframe, until gravity is known.
struct VinsWindow {
  int64_t origin_ns = 0;  // gyro clock
  Calibration calibration;
  ImuIntegral imu;  // gyro bias of the calibration removed; accelerometer bias not
  std::vector<VinsKeyframe> keyframes;
  std::vector<int64_t> track_ids;             // of the landmarks
  std::vector<VinsObservation> observations;  // by landmark, then keyframe
};

// Keyframes about interval_s apart, the first and the last frame among them; tracks seen in at
// least three. Of the calibration's effects those that are a constant part of the lens count;
// effects of clock and rate do not. Errors: kBadInput for data that are not finite or not in order;
// kCannotEstimate for fewer than 4 keyframes, gyro samples that do not cover them, fewer than 15
// tracks.
Result<VinsWindow> MakeVinsWindow(const VinsInput& input, double interval_s);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_VINS_VINS_WINDOW_H_
