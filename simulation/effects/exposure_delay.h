// Stamps of another moment of the exposure than its middle.
#ifndef CAMGYRO_SIMULATION_EFFECTS_EXPOSURE_DELAY_H_
#define CAMGYRO_SIMULATION_EFFECTS_EXPOSURE_DELAY_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct ExposureDelay {
  static constexpr char kName[] = "exposure_delay";
  double factor = 0.0;  // 0.5: stamps are starts of the exposure

  template <typename Section>
  void Read(Section* section) {
    section->Read("factor", &factor);
  }
  bool active() const { return factor != 0.0; }
  TruthParameters Truth() const { return {{"factor", "1", factor}}; }
  void AddDelay(const FrameClock& frame, double* delay_s) const {
    *delay_s += factor * frame.exposure_s;
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_EXPOSURE_DELAY_H_
