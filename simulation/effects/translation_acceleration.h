// A path that bends within a pair of frames: a shake of 3 to 8 Hz.
#ifndef CAMGYRO_SIMULATION_EFFECTS_TRANSLATION_ACCELERATION_H_
#define CAMGYRO_SIMULATION_EFFECTS_TRANSLATION_ACCELERATION_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct TranslationAcceleration {
  static constexpr char kName[] = "translation_acceleration";
  double shake_m_s = 0.0;  // rms of its velocity

  template <typename Section>
  void Read(Section* section) {
    section->Read("shake_m_s", &shake_m_s, Range::kNotNegative);
  }
  bool active() const { return shake_m_s > 0.0; }
  TruthParameters Truth() const { return {{"shake", "m/s", shake_m_s}}; }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_TRANSLATION_ACCELERATION_H_
