// A lens group that moves against fast rotation.
#ifndef CAMGYRO_SIMULATION_EFFECTS_OPTICAL_STABILISATION_H_
#define CAMGYRO_SIMULATION_EFFECTS_OPTICAL_STABILISATION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct OpticalStabilisation {
  static constexpr char kName[] = "optical_stabilisation";
  double gain = 0.0;  // 1: the whole high-passed rotation is taken out
  double corner_hz = 0.5;
  double travel_rad = 0.0;  // the angle in any direction at which the lens is at its stop; 0: none
  double logged_px = 0.0;   // px of the picture per unit of the scenario's log of the lens
  double log_hz = 0.0;      // the recording has the lens's shift, so often; 0: it has not

  template <typename Section>
  void Read(Section* section) {
    section->Read("gain", &gain);
    section->Read("corner_hz", &corner_hz, Range::kPositive);
    section->Read("travel_rad", &travel_rad, Range::kNotNegative);
    section->Read("logged_px", &logged_px);
    section->Read("log_hz", &log_hz, Range::kNotNegative);
  }
  bool active() const { return gain != 0.0 || logged_px != 0.0; }
  TruthParameters Truth() const {
    return {{"gain", "1", gain},
            {"corner", "Hz", corner_hz},
            {"travel", "rad", travel_rad},
            {"logged", "px", logged_px}};
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_OPTICAL_STABILISATION_H_
