// A start for a VIO: poses, velocities, gravity, scale, biases and landmarks of a window of about
// two seconds, by the four steps of Feng, Li & Dai (CSNC 2018), with covariance and a verdict.
#ifndef CAMGYRO_VINS_H_
#define CAMGYRO_VINS_H_

#include <string>
#include <vector>

#include "camgyro/export.h"
#include "camgyro/types.h"

namespace camgyro::api {

// Continuous white noise of one axis; the camera in the gyro frame, as far as it is known.
struct VinsSettings {
  double gyro_noise_rad_s_rtHz = 2e-4;
  double accel_noise_m_s2_rtHz = 3e-3;
  double accel_bias_sigma_m_s2 = 0.2;
  Vec3 p_gyro_cam_m{};
  double p_gyro_cam_sigma_m = 0.05;
  double gravity_m_s2 = 9.80665;
  double window_s = 2.0;
};

enum class VinsVerdict {
  kReady,
  kNoCalibration,  // the calibrator has no estimate yet
  kNoAccelerometer,
  kTooFewData,  // frames, tracks or gyro samples: the explanation says which
  kTooLittleExcitation,
  kTooLittleParallax,
  kAccelerometerImplausible,
  kCalibrationImplausible,
  kImprecise,
  kNotConverged,
  kBadInput,
};
CAMGYRO_API const char* ToString(VinsVerdict verdict) noexcept;

// World: origin and axes of the gyro frame at the first keyframe.
struct VinsState {
  std::int64_t frame_stamp_ns = 0;  // camera clock
  std::int64_t time_ns = 0;         // gyro clock: the frame's middle row
  std::array<double, 4> q_world_gyro_wxyz{1.0, 0.0, 0.0, 0.0};
  Vec3 p_world_m{}, v_world_m_s{};
};

struct VinsLandmark {
  std::int64_t track_id = 0;
  std::array<double, 4> point{};  // homogeneous: (x, y, z) / w in the world [m]; w <= 0: far away
  std::array<double, 9> covariance_m2{};
  int observations = 0;
};

struct VinsStart {
  VinsVerdict verdict = VinsVerdict::kNoCalibration;
  std::string explanation;
  std::vector<VinsState> states;
  Vec3 gravity_world_m_s2{};  // points down
  Vec3 bias_accel_m_s2{};
  Vec3 p_gyro_cam_m{};
  Calibration calibration;  // moved within its covariance
  std::vector<VinsLandmark> landmarks;
  // Joint covariance, row after row, of covariance_size rows: for each state rotation (right
  // perturbation of q_world_gyro) [rad], position [m], velocity [m/s]; then gravity [m/s^2],
  // accelerometer bias [m/s^2], p_gyro_cam [m], calibration in the order of Parameter.
  std::size_t covariance_size = 0;
  std::vector<double> covariance;
  double scale_sigma = 0.0;  // relative
  double gravity_sigma_rad = 0.0;
};

}  // namespace camgyro::api

#endif  // CAMGYRO_VINS_H_
