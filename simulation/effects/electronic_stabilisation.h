// A picture that is warped against the rotation before it is stored.
#ifndef CAMGYRO_SIMULATION_EFFECTS_ELECTRONIC_STABILISATION_H_
#define CAMGYRO_SIMULATION_EFFECTS_ELECTRONIC_STABILISATION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct ElectronicStabilisation {
  static constexpr char kName[] = "electronic_stabilisation";
  double strength = 0.0;     // 1: the rotation is replaced by its smoothed course
  double smoothing_s = 0.5;  // sigma of the smoothing

  template <typename Section>
  void Read(Section* section) {
    section->Read("strength", &strength, Range::kFraction);
    section->Read("smoothing_s", &smoothing_s, Range::kPositive);
  }
  bool active() const { return strength != 0.0; }
  TruthParameters Truth() const {
    return {{"strength", "1", strength}, {"smoothing", "s", smoothing_s}};
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_ELECTRONIC_STABILISATION_H_
