// A gyro that feels forces: its structure bends under them.
#ifndef CAMGYRO_SIMULATION_EFFECTS_GYRO_G_SENSITIVITY_H_
#define CAMGYRO_SIMULATION_EFFECTS_GYRO_G_SENSITIVITY_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct GyroGSensitivity {
  static constexpr char kName[] = "gyro_g_sensitivity";
  // Of each axis of the reading by the same axis of the specific force [rad/s per m/s^2].
  Eigen::Vector3d factor_rad_s_m = Eigen::Vector3d::Zero();

  template <typename Section>
  void Read(Section* section) {
    section->Read("factor_rad_s_m", &factor_rad_s_m);
  }
  bool active() const { return !factor_rad_s_m.isZero(0.0); }
  TruthParameters Truth() const {
    return {{"x", "rad s/m", factor_rad_s_m.x()},
            {"y", "rad s/m", factor_rad_s_m.y()},
            {"z", "rad s/m", factor_rad_s_m.z()}};
  }
  void AddRate(const RateInput& input, Eigen::Vector3d* reading_rad_s) const {
    *reading_rad_s += factor_rad_s_m.cwiseProduct(input.force_m_s2);
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_GYRO_G_SENSITIVITY_H_
