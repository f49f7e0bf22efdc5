// The gyro's axes, sampled one after the other.
#ifndef CAMGYRO_SIMULATION_EFFECTS_GYRO_AXIS_DELAY_H_
#define CAMGYRO_SIMULATION_EFFECTS_GYRO_AXIS_DELAY_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

// Readings of y and z are of a time so much before that of x, whose delay is a part of the clock's.
struct GyroAxisDelay {
  static constexpr char kName[] = "gyro_axis_delay";
  double y_after_x_s = 0.0;
  double z_after_x_s = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("y_after_x_s", &y_after_x_s);
    section->Read("z_after_x_s", &z_after_x_s);
  }
  bool active() const { return y_after_x_s != 0.0 || z_after_x_s != 0.0; }
  TruthParameters Truth() const {
    return {{"y_after_x", "s", y_after_x_s}, {"z_after_x", "s", z_after_x_s}};
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_GYRO_AXIS_DELAY_H_
