// A lens that is not centred on the sensor (radial-tangential model).
#ifndef CAMGYRO_SIMULATION_EFFECTS_TANGENTIAL_DISTORTION_H_
#define CAMGYRO_SIMULATION_EFFECTS_TANGENTIAL_DISTORTION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct TangentialDistortion {
  static constexpr char kName[] = "tangential_distortion";
  double p1 = 0.0, p2 = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("p1", &p1);
    section->Read("p2", &p2);
  }
  bool active() const { return p1 != 0.0 || p2 != 0.0; }
  TruthParameters Truth() const { return {{"p1", "1", p1}, {"p2", "1", p2}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_TANGENTIAL_DISTORTION_H_
