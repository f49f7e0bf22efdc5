// Clocks of different speed: t_d grows by so much per second.
#ifndef CAMGYRO_SIMULATION_EFFECTS_CLOCK_SKEW_H_
#define CAMGYRO_SIMULATION_EFFECTS_CLOCK_SKEW_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct ClockSkew {
  static constexpr char kName[] = "clock_skew";
  double ppm = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("ppm", &ppm);
  }
  bool active() const { return ppm != 0.0; }
  TruthParameters Truth() const { return {{"skew", "ppm", ppm}}; }
  void AddDelay(const FrameClock& frame, double* delay_s) const {
    *delay_s += 1e-6 * ppm * frame.time_s;
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_CLOCK_SKEW_H_
