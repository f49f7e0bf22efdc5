// A delay that moves slowly to and fro.
#ifndef CAMGYRO_SIMULATION_EFFECTS_DELAY_WANDER_H_
#define CAMGYRO_SIMULATION_EFFECTS_DELAY_WANDER_H_

#include <cmath>

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct DelayWander {
  static constexpr char kName[] = "delay_wander";
  double amplitude_s = 0.0, period_s = 7.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("amplitude_s", &amplitude_s);
    section->Read("period_s", &period_s, Range::kPositive);
  }
  bool active() const { return amplitude_s != 0.0; }
  TruthParameters Truth() const {
    return {{"amplitude", "s", amplitude_s}, {"period", "s", period_s}};
  }
  // Two incommensurable periods: neither a line nor a single tone.
  void AddDelay(const FrameClock& frame, double* delay_s) const {
    const double turn = 2.0 * M_PI * frame.time_s / period_s;
    *delay_s += amplitude_s * (0.7 * std::sin(turn) + 0.3 * std::sin(1.618 * turn + 1.0));
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_DELAY_WANDER_H_
