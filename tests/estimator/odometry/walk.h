// Simulated walks with what an odometry needs to follow them, and the truth in its world.
#ifndef CAMGYRO_TESTS_ESTIMATOR_ODOMETRY_WALK_H_
#define CAMGYRO_TESTS_ESTIMATOR_ODOMETRY_WALK_H_

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/so3.h"
#include "estimator/odometry/follow_recording.h"
#include "tests/estimator/vins/vins_scene.h"

namespace camgyro {

struct Walk {
  simulation::Scenario scenario;
  simulation::Simulated simulated;
  Calibration calibration;
  OdometryOptions options;

  Result<OdometryRun> Follow() const {
    return FollowRecording(simulated.recording, calibration, options, nullptr);
  }
};

inline Walk WalkOf(const simulation::Scenario& scenario) {
  Walk walk;
  walk.scenario = scenario;
  auto simulated = simulation::SimulateTracks(walk.scenario);
  EXPECT_TRUE(simulated);
  walk.simulated = std::move(*simulated);
  walk.calibration = GoodCalibration(walk.simulated);
  const VinsOptions noise = SimulatorsNoise(walk.scenario);
  walk.options.noise = noise.noise;
  walk.options.walk = {walk.scenario.gyro.bias_walk_rad_s2_rtHz, 1e-4};
  walk.options.p_gyro_cam_m = walk.scenario.mount.p_gyro_cam_m;
  walk.options.p_gyro_cam_sigma_m = 0.01;
  return walk;
}

// A simulated walk, straight on, with a readout of 20 ms.
inline Walk WalkFor(double duration_s, uint64_t seed = 1) {
  simulation::Scenario scenario = WalkingScenario(duration_s);
  scenario.seed = seed;
  return WalkOf(scenario);
}

// The simulator's world has y down; this turns it so that z is up.
inline Eigen::Quaterniond UpOfSimulator() {
  return Eigen::Quaterniond(Eigen::AngleAxisd(-0.5 * M_PI, Eigen::Vector3d::UnitX()));
}

// The truth in the odometry's world: z up, at the pose `at` the estimate's position and yaw.
class TruthFrom {
 public:
  TruthFrom(const Walk& walk, const OdometryPose& at) : walk_(walk) {
    const VinsState truth = TrueState(walk.simulated, walk.scenario, at.time_ns);
    const Eigen::Quaterniond up = UpOfSimulator();
    const Eigen::Matrix3d R =
        (at.state.q_world_gyro * (up * truth.q_world_gyro).conjugate()).toRotationMatrix();
    const double yaw = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
    q_ = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * up;
    t_ = at.state.p_world_m - q_ * truth.p_world_m;
  }
  Eigen::Vector3d PositionError(const OdometryPose& pose) const {
    const VinsState truth = TrueState(walk_.simulated, walk_.scenario, pose.time_ns);
    return pose.state.p_world_m - (q_ * truth.p_world_m + t_);
  }
  Eigen::Vector3d VelocityError(const OdometryPose& pose) const {
    const VinsState truth = TrueState(walk_.simulated, walk_.scenario, pose.time_ns);
    return pose.state.v_world_m_s - q_ * truth.v_world_m_s;
  }
  Eigen::Vector3d RotationError(const OdometryPose& pose) const {
    const VinsState truth = TrueState(walk_.simulated, walk_.scenario, pose.time_ns);
    return Log(Eigen::Quaterniond((q_ * truth.q_world_gyro).conjugate() * pose.state.q_world_gyro));
  }

 private:
  const Walk& walk_;
  Eigen::Quaterniond q_;
  Eigen::Vector3d t_;
};

inline double Largest(const std::vector<OdometryPose>& poses, const TruthFrom& truth) {
  double largest = 0.0;
  for (const OdometryPose& pose : poses) {
    largest = std::max(largest, truth.PositionError(pose).norm());
  }
  return largest;
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_ESTIMATOR_ODOMETRY_WALK_H_
