// Rows that are not read evenly: s = v / h becomes s + 4 curve s (1 - s).
#ifndef CAMGYRO_SIMULATION_EFFECTS_READOUT_NONLINEAR_H_
#define CAMGYRO_SIMULATION_EFFECTS_READOUT_NONLINEAR_H_

#include <cmath>

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct ReadoutNonlinear {
  static constexpr char kName[] = "readout_nonlinear";
  double curve = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("curve", &curve);
    if (std::abs(curve) >= 0.25) {
      section->Complain({}, "curve", "must lie between -0.25 and 0.25: rows are read in order");
    }
  }
  bool active() const { return curve != 0.0; }
  TruthParameters Truth() const { return {{"curve", "1", curve}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_READOUT_NONLINEAR_H_
