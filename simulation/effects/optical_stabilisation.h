// A lens group that moves against fast rotation.
#ifndef CAMGYRO_SIMULATION_EFFECTS_OPTICAL_STABILISATION_H_
#define CAMGYRO_SIMULATION_EFFECTS_OPTICAL_STABILISATION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct OpticalStabilisation {
  static constexpr char kName[] = "optical_stabilisation";
  double gain = 0.0;  // 1: the whole high-passed rotation is taken out
  double corner_hz = 0.5;

  template <typename Section>
  void Read(Section* section) {
    section->Read("gain", &gain);
    section->Read("corner_hz", &corner_hz, Range::kPositive);
  }
  bool active() const { return gain != 0.0; }
  TruthParameters Truth() const { return {{"gain", "1", gain}, {"corner", "Hz", corner_hz}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_OPTICAL_STABILISATION_H_
