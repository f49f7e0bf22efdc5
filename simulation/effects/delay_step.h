// Stamps that are off from one frame on.
#ifndef CAMGYRO_SIMULATION_EFFECTS_DELAY_STEP_H_
#define CAMGYRO_SIMULATION_EFFECTS_DELAY_STEP_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct DelayStep {
  static constexpr char kName[] = "delay_step";
  double time_s = 0.0, step_s = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("time_s", &time_s);
    section->Read("step_s", &step_s);
  }
  bool active() const { return step_s != 0.0; }
  TruthParameters Truth() const { return {{"time", "s", time_s}, {"step", "s", step_s}}; }
  void AddDelay(const FrameClock& frame, double* delay_s) const {
    if (frame.time_s >= time_s) *delay_s += step_s;
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_DELAY_STEP_H_
