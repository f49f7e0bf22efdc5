// Smooth motions of the camera, with rates that are exact derivatives of the pose.
#ifndef CAMGYRO_SIMULATION_TRAJECTORY_H_
#define CAMGYRO_SIMULATION_TRAJECTORY_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <random>
#include <string>

#include "core/result.h"
#include "simulation/scenario.h"

namespace camgyro::simulation {

// The camera at one time. World frame: y down (gravity along +y), see SceneOptions.
struct CameraState {
  Eigen::Matrix3d R_world_cam;
  Eigen::Vector3d p_world_m;         // of the camera
  Eigen::Vector3d v_world_m_s;       // its derivative
  Eigen::Vector3d a_world_m_s2;      // and the next one
  Eigen::Vector3d omega_cam_rad_s;   // R' = R [omega]x
  Eigen::Vector3d alpha_cam_rad_s2;  // derivative of omega_cam
};

class Trajectory {
 public:
  virtual ~Trajectory() = default;
  // Any time is allowed; seconds after the first gyro stamp.
  virtual CameraState At(double time_s) const = 0;
};

// The motion of a scenario. Draws its phases from `random`. Errors: the trajectory file.
Result<std::shared_ptr<const Trajectory>> MakeTrajectory(const Scenario& scenario,
                                                         std::mt19937_64* random);

// Cumulative cubic B-spline on SO(3) x R^3 through the poses of a file: lines of
// "t[s] x y z qx qy qz qw" (TUM) or "t[ns], x, y, z, qw, qx, qy, qz, ..." (EuRoC), pose of the
// camera in a world whose z axis is up. The poses are interpolated at knots of `knot_s`, which are
// the control points: the curve is C2 and smooths what is faster than the knots. Time 0 is the
// first pose; before and after, the ends are held.
Result<std::shared_ptr<const Trajectory>> ReadTrajectory(const std::string& path, double knot_s,
                                                         const Eigen::Isometry3d& T_pose_cam);

// Turns as the gyro of a log did, whose rates are taken as they are, and does not move; level at
// first. The same spline, with knots every two of its intervals.
std::shared_ptr<const Trajectory> TurnsOfLog(const DeviceLog& log,
                                             const Eigen::Quaterniond& q_gyro_cam);

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_TRAJECTORY_H_
