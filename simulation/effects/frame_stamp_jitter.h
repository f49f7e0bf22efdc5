// Recorded stamps that scatter; the frames themselves come evenly.
#ifndef CAMGYRO_SIMULATION_EFFECTS_FRAME_STAMP_JITTER_H_
#define CAMGYRO_SIMULATION_EFFECTS_FRAME_STAMP_JITTER_H_

#include <cmath>

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct FrameStampJitter {
  static constexpr char kName[] = "frame_stamp_jitter";
  double spread_s = 0.0;   // sigma of a Gaussian error
  double latency_s = 0.0;  // mean of an exponential latency, which is added
  // Sigma of an error that neighbours share: a first-order Gauss-Markov process, whose correlation
  // falls as exp(-time apart / wander_time_s).
  double wander_s = 0.0, wander_time_s = 1.5;

  template <typename Section>
  void Read(Section* section) {
    section->Read("spread_s", &spread_s, Range::kNotNegative);
    section->Read("latency_s", &latency_s, Range::kNotNegative);
    section->Read("wander_s", &wander_s, Range::kNotNegative);
    section->Read("wander_time_s", &wander_time_s, Range::kPositive);
  }
  bool active() const { return spread_s > 0.0 || latency_s > 0.0 || wander_s > 0.0; }
  TruthParameters Truth() const {
    return {{"spread", "s", std::hypot(spread_s, latency_s)},
            {"latency", "s", latency_s},
            {"wander", "s", wander_s}};
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_FRAME_STAMP_JITTER_H_
