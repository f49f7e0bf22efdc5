// Attitudes that were made from the rows of a rolling shutter as if all were of one time.
#ifndef CAMGYRO_SIMULATION_EFFECTS_ATTITUDE_ROLLING_SHUTTER_H_
#define CAMGYRO_SIMULATION_EFFECTS_ATTITUDE_ROLLING_SHUTTER_H_

#include <Eigen/Core>

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

// The attitude is turned about the camera's z by so many times its rate about y, and about y by so
// many times its rate about z.
struct AttitudeRollingShutter {
  static constexpr char kName[] = "attitude_rolling_shutter";
  double roll_by_yaw_s = 0.0;
  double yaw_by_roll_s = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("roll_by_yaw_s", &roll_by_yaw_s);
    section->Read("yaw_by_roll_s", &yaw_by_roll_s);
  }
  bool active() const { return roll_by_yaw_s != 0.0 || yaw_by_roll_s != 0.0; }
  TruthParameters Truth() const {
    return {{"roll_by_yaw", "s", roll_by_yaw_s}, {"yaw_by_roll", "s", yaw_by_roll_s}};
  }
  // What an attitude is turned by [rad], camera frame.
  Eigen::Vector3d Error(const Eigen::Vector3d& omega_cam_rad_s) const {
    return {0.0, yaw_by_roll_s * omega_cam_rad_s.z(), roll_by_yaw_s * omega_cam_rad_s.y()};
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_ATTITUDE_ROLLING_SHUTTER_H_
