// What a VIO needs to begin: the VINS initialisation in the four steps of Feng, Li & Dai,
// CSNC 2018, section 2 (2), with delay, rotation, lens, readout and gyro bias from our calibration.
//   (a) does the accelerometer feel enough to tell the scale?
//   (b) structure of the window, up to scale (structure.h)
//   (c) linear alignment: velocities, gravity, scale, accelerometer bias (alignment.h)
//   (d) gravity on its sphere, then everything together, non-linearly
#ifndef CAMGYRO_ESTIMATOR_VINS_INITIALISE_H_
#define CAMGYRO_ESTIMATOR_VINS_INITIALISE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/imu_integral.h"
#include "core/result.h"
#include "estimator/vins/vins_window.h"

namespace camgyro {

struct VinsOptions {
  double keyframe_interval_s = 0.2;
  ImuNoise noise;
  // Camera in the gyro frame, as far as it is known [m].
  Eigen::Vector3d p_gyro_cam_m = Eigen::Vector3d::Zero();
  double p_gyro_cam_sigma_m = 0.05;
  double gravity_m_s2 = 9.80665;
  double accel_bias_sigma_m_s2 = 0.2;  // around zero
  // Ready means: known to
  double ready_scale = 0.10;                    // relative, one sigma
  double ready_gravity_rad = 2.0 * M_PI / 180;  // one sigma per axis
};

enum class VinsVerdict {
  kReady,
  kNoAccelerometer,
  kTooFewTracks,              // or frames, or gyro samples: the explanation says which
  kTooLittleExcitation,       // the accelerometer feels nothing but gravity: no scale
  kTooLittleParallax,         // the camera turns, but hardly moves: no structure
  kAccelerometerImplausible,  // it contradicts the camera and the gyro: axes, unit, clock
  kCalibrationImplausible,    // most tracks contradict the gyro's rotations: delay, mounting, lens
  kImprecise,                 // sound, but scale or gravity are not known well enough yet
  kNotConverged,
};
std::string VinsVerdictName(VinsVerdict verdict);  // "ready", "no_accelerometer", ...

// A keyframe's state. World frame: origin and axes of the gyro (IMU) frame at the first keyframe.
struct VinsState {
  int64_t frame_stamp_ns = 0;  // camera clock
  int64_t time_ns = 0;         // gyro clock: exposure of the frame's middle row
  Eigen::Quaterniond q_world_gyro = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_world_m_s = Eigen::Vector3d::Zero();
};

struct VinsLandmark {
  int64_t track_id = 0;
  // Homogeneous: the point is head<3>() / w() in the world [m]; w near 0 or below: too far to tell.
  Eigen::Vector4d point = Eigen::Vector4d::UnitZ();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  // of the point, to first order
  int observations = 0;                                     // inliers
};

struct VinsStart {
  VinsVerdict verdict = VinsVerdict::kNotConverged;
  std::string explanation;  // for people, with numbers

  // Filled as far as the steps got.
  double excitation_m_s2 = 0.0;  // spread of the mean specific force between keyframes, (a)
  double parallax_rad = 0.0;     // (b)

  std::vector<VinsState> states;
  Eigen::Vector3d gravity_world_m_s2 = Eigen::Vector3d::Zero();  // points down: a_still = -g
  Eigen::Vector3d bias_accel_m_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_gyro_cam_m = Eigen::Vector3d::Zero();
  Calibration calibration;  // of the input, moved within its covariance, which is the result's
  std::vector<VinsLandmark> landmarks;

  // Joint covariance: for each state rotation (right perturbation of q_world_gyro) [rad], position
  // [m], velocity [m/s]; then gravity [m/s^2] (rank 2: its length is known), accelerometer bias
  // [m/s^2], p_gyro_cam [m], calibration in the order of StateIndex. The first state's pose is the
  // world: its rows are zero.
  Eigen::MatrixXd covariance;
  Eigen::Index StateRow(size_t state) const { return 9 * static_cast<Eigen::Index>(state); }
  Eigen::Index GravityRow() const { return StateRow(states.size()); }
  Eigen::Index AccelBiasRow() const { return GravityRow() + 3; }
  Eigen::Index ArmRow() const { return GravityRow() + 6; }
  Eigen::Index CalibrationRow() const { return GravityRow() + 9; }

  double scale_sigma = 0.0;        // relative
  double gravity_sigma_rad = 0.0;  // the larger of the two axes
  double noise_px = 0.0;           // of an observation, per axis
  int observations = 0;            // used; of those in keyframes, the share
  double inlier_ratio = 0.0;
  // Accelerometer noise that the window shows, over the one assumed; sigmas are scaled by it.
  double accel_noise_factor = 1.0;
};

// Errors: kBadInput for data that are not finite or not in order. What the data do not allow is the
// verdict. Repeatable bit for bit.
Result<VinsStart> InitialiseVins(const VinsInput& input, const VinsOptions& options = {});

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_VINS_INITIALISE_H_
