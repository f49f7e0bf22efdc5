// Axes of the gyro that are not at right angles to each other.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// reading = (I + S) rate, S symmetric with zero diagonal: the antisymmetric part is a rotation,
// which q_gyro_cam has.
class GyroMisalignment final : public Effect {
 public:
  explicit GyroMisalignment(const EffectSetup&)
      : Effect({{"xy", "", 0.02, -0.1, 0.1},
                {"xz", "", 0.02, -0.1, 0.1},
                {"yz", "", 0.02, -0.1, 0.1}}) {}
  void ChangeRate(double, const Eigen::Vector3d& w, RateColumns columns) const override {
    columns << w.y(), w.z(), 0.0,  //
        w.x(), 0.0, w.z(),         //
        0.0, w.x(), w.y();
  }
  Eigen::Matrix3d RateByRate(const double* s) const override {
    return (Eigen::Matrix3d() << 0.0, s[0], s[1], s[0], 0.0, s[2], s[1], s[2], 0.0).finished();
  }
};

}  // namespace

EffectEntry GyroMisalignmentEntry() {
  return WithOneShape<GyroMisalignment>(
      {"gyro_misalignment", ModelPart::kRate,
       "the axes of the gyro are not at right angles to each other",
       "multiply the readings by the inverse of I + S"},
      "constant", AlwaysShown);
}

}  // namespace camgyro
