// A lens that bends straight lines alike in all directions from the principal point.
#ifndef CAMGYRO_SIMULATION_EFFECTS_RADIAL_DISTORTION_H_
#define CAMGYRO_SIMULATION_EFFECTS_RADIAL_DISTORTION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct RadialDistortion {
  static constexpr char kName[] = "radial_distortion";
  double k1 = 0.0, k2 = 0.0, k3 = 0.0, k4 = 0.0;  // k3, k4: Kannala-Brandt only
  bool kannala_brandt = false;

  template <typename Section>
  void Read(Section* section) {
    section->Read("model", &kannala_brandt, {{"radtan", false}, {"kb4", true}});
    section->Read("k1", &k1);
    section->Read("k2", &k2);
    section->Read("k3", &k3);
    section->Read("k4", &k4);
    if (!kannala_brandt && (k3 != 0.0 || k4 != 0.0)) {
      section->Complain({}, "k3", "and k4 belong to model kb4");
    }
  }
  bool active() const { return kannala_brandt || k1 != 0.0 || k2 != 0.0; }
  TruthParameters Truth() const {
    TruthParameters truth = {{"k1", "1", k1}, {"k2", "1", k2}};
    if (kannala_brandt) truth.insert(truth.end(), {{"k3", "1", k3}, {"k4", "1", k4}});
    return truth;
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_RADIAL_DISTORTION_H_
