// The gyro's full scale.
#ifndef CAMGYRO_SIMULATION_EFFECTS_GYRO_SATURATION_H_
#define CAMGYRO_SIMULATION_EFFECTS_GYRO_SATURATION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct GyroSaturation {
  static constexpr char kName[] = "gyro_saturation";
  double limit_rad_s = 0.0;  // 0: none

  template <typename Section>
  void Read(Section* section) {
    section->Read("limit_rad_s", &limit_rad_s, Range::kNotNegative);
  }
  bool active() const { return limit_rad_s > 0.0; }
  TruthParameters Truth() const { return {{"limit", "rad/s", limit_rad_s}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_GYRO_SATURATION_H_
