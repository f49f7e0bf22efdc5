// The gyro's low-pass filter, first order.
#ifndef CAMGYRO_SIMULATION_EFFECTS_GYRO_LOWPASS_H_
#define CAMGYRO_SIMULATION_EFFECTS_GYRO_LOWPASS_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct GyroLowpass {
  static constexpr char kName[] = "gyro_lowpass";
  double time_constant_s = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("time_constant_s", &time_constant_s, Range::kNotNegative);
  }
  bool active() const { return time_constant_s > 0.0; }
  TruthParameters Truth() const { return {{"time_constant", "s", time_constant_s}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_GYRO_LOWPASS_H_
