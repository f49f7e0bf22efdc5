// Pixels that are not square.
#ifndef CAMGYRO_SIMULATION_EFFECTS_ASPECT_RATIO_H_
#define CAMGYRO_SIMULATION_EFFECTS_ASPECT_RATIO_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct AspectRatio {
  static constexpr char kName[] = "aspect_ratio";
  double ratio = 1.0;  // fx / fy

  template <typename Section>
  void Read(Section* section) {
    section->Read("ratio", &ratio, Range::kPositive);
  }
  bool active() const { return ratio != 1.0; }
  TruthParameters Truth() const { return {{"ratio", "1", ratio}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_ASPECT_RATIO_H_
