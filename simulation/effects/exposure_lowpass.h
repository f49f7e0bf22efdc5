// The picture averages over its exposure: a point is seen at the mean of its places.
#ifndef CAMGYRO_SIMULATION_EFFECTS_EXPOSURE_LOWPASS_H_
#define CAMGYRO_SIMULATION_EFFECTS_EXPOSURE_LOWPASS_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct ExposureLowpass {
  static constexpr char kName[] = "exposure_lowpass";
  double factor = 0.0;  // of the exposure that is averaged over

  template <typename Section>
  void Read(Section* section) {
    section->Read("factor", &factor, Range::kNotNegative);
  }
  bool active() const { return factor > 0.0; }
  TruthParameters Truth() const { return {{"factor", "1", factor}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_EXPOSURE_LOWPASS_H_
