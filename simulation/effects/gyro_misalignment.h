// Axes of the gyro that are not at right angles: a symmetric matrix, with no rotation in it.
#ifndef CAMGYRO_SIMULATION_EFFECTS_GYRO_MISALIGNMENT_H_
#define CAMGYRO_SIMULATION_EFFECTS_GYRO_MISALIGNMENT_H_

#include "simulation/effects/simulated_effect.h"

namespace camgyro::simulation {

struct GyroMisalignment {
  static constexpr char kName[] = "gyro_misalignment";
  double xy = 0.0, xz = 0.0, yz = 0.0;

  template <typename Section>
  void Read(Section* section) {
    section->Read("xy", &xy);
    section->Read("xz", &xz);
    section->Read("yz", &yz);
  }
  bool active() const { return xy != 0.0 || xz != 0.0 || yz != 0.0; }
  TruthParameters Truth() const {
    return {{"xy", "rad", xy}, {"xz", "rad", xz}, {"yz", "rad", yz}};
  }
  void AddRateMatrix(Eigen::Matrix3d* reading_by_rate) const {
    Eigen::Matrix3d S;
    S << 0.0, xy, xz, xy, 0.0, yz, xz, yz, 0.0;
    *reading_by_rate += S;
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_GYRO_MISALIGNMENT_H_
