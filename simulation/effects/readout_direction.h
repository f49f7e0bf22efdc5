// Rows from bottom to top, or columns instead of rows.
#ifndef CAMGYRO_SIMULATION_EFFECTS_READOUT_DIRECTION_H_
#define CAMGYRO_SIMULATION_EFFECTS_READOUT_DIRECTION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct ReadoutDirection {
  static constexpr char kName[] = "readout_direction";
  bool reversed = false;  // t_r changes its sign
  bool columns = false;   // reads column after column, left to right: t_r u / w

  template <typename Section>
  void Read(Section* section) {
    section->Read("reversed", &reversed);
    section->Read("columns", &columns);
  }
  bool active() const { return reversed || columns; }
  TruthParameters Truth() const {
    return {{"reversed", "1", reversed ? 1.0 : 0.0}, {"columns", "1", columns ? 1.0 : 0.0}};
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_READOUT_DIRECTION_H_
