// A bias that changes: b(t) = b + rate t + swing sin(2 pi t / period).
#ifndef CAMGYRO_SIMULATION_EFFECTS_BIAS_DRIFT_H_
#define CAMGYRO_SIMULATION_EFFECTS_BIAS_DRIFT_H_

#include <cmath>

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct BiasDrift {
  static constexpr char kName[] = "bias_drift";
  Eigen::Vector3d rate_rad_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d swing_rad_s = Eigen::Vector3d::Zero();
  double period_s = 60.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("rate_rad_s2", &rate_rad_s2);
    section->Read("swing_rad_s", &swing_rad_s);
    section->Read("period_s", &period_s, Range::kPositive);
  }
  bool active() const { return !rate_rad_s2.isZero(0.0) || !swing_rad_s.isZero(0.0); }
  TruthParameters Truth() const {
    return {{"rate_x", "rad/s^2", rate_rad_s2.x()},
            {"rate_y", "rad/s^2", rate_rad_s2.y()},
            {"rate_z", "rad/s^2", rate_rad_s2.z()},
            {"swing_x", "rad/s", swing_rad_s.x()},
            {"swing_y", "rad/s", swing_rad_s.y()},
            {"swing_z", "rad/s", swing_rad_s.z()},
            {"period", "s", period_s}};
  }
  void AddBias(double time_s, Eigen::Vector3d* bias_rad_s) const {
    *bias_rad_s += rate_rad_s2 * time_s;
    *bias_rad_s += swing_rad_s * std::sin(2.0 * M_PI * time_s / period_s);
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_BIAS_DRIFT_H_
