// A focal length that changes: f(t) = f + rate t + breathing sin(2 pi t / period).
#ifndef CAMGYRO_SIMULATION_EFFECTS_FOCAL_DRIFT_H_
#define CAMGYRO_SIMULATION_EFFECTS_FOCAL_DRIFT_H_

#include <cmath>

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct FocalDrift {
  static constexpr char kName[] = "focal_drift";
  double rate_px_s = 0.0, breathing_px = 0.0, period_s = 8.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("rate_px_s", &rate_px_s);
    section->Read("breathing_px", &breathing_px);
    section->Read("period_s", &period_s, Range::kPositive);
  }
  bool active() const { return rate_px_s != 0.0 || breathing_px != 0.0; }
  TruthParameters Truth() const {
    return {
        {"rate", "px/s", rate_px_s}, {"breathing", "px", breathing_px}, {"period", "s", period_s}};
  }
  void AddFocal(double time_s, double* focal_px) const {
    *focal_px += rate_px_s * time_s;
    *focal_px += breathing_px * std::sin(2.0 * M_PI * time_s / period_s);
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_FOCAL_DRIFT_H_
