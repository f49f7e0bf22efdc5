// Sensitivity errors of the gyro's axes.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class GyroScale final : public Effect {
 public:
  explicit GyroScale(const EffectSetup&)
      : Effect(
            {{"x", "", 0.03, -0.1, 0.1}, {"y", "", 0.03, -0.1, 0.1}, {"z", "", 0.03, -0.1, 0.1}}) {}
  void ChangeRate(double, const Eigen::Vector3d& omega, RateColumns columns) const override {
    columns = omega.asDiagonal();
  }
  Eigen::Matrix3d RateByRate(const double* values) const override {
    return Eigen::Map<const Eigen::Vector3d>(values).asDiagonal();
  }
};

}  // namespace

EffectEntry GyroScaleEntry() {
  return WithOneShape<GyroScale>(
      {"gyro_scale", ModelPart::kRate,
       "the gyro reads too much or too little, in proportion to the rate, on each axis",
       "divide each axis by 1 + its scale error"},
      "constant", AlwaysShown);
}

}  // namespace camgyro
