// Sensitivity errors of the gyro's axes.
#ifndef CAMGYRO_SIMULATION_EFFECTS_GYRO_SCALE_H_
#define CAMGYRO_SIMULATION_EFFECTS_GYRO_SCALE_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct GyroScale {
  static constexpr char kName[] = "gyro_scale";
  Eigen::Vector3d error = Eigen::Vector3d::Zero();

  template <typename Section>
  void Read(Section* section) {
    section->Read("error", &error);
  }
  bool active() const { return !error.isZero(0.0); }
  TruthParameters Truth() const {
    return {{"x", "1", error.x()}, {"y", "1", error.y()}, {"z", "1", error.z()}};
  }
  void AddRateMatrix(Eigen::Matrix3d* reading_by_rate) const {
    reading_by_rate->diagonal() += error;
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_GYRO_SCALE_H_
