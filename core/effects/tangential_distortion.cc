// Lens elements that are not centred on the sensor's normal.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class TangentialDistortion final : public Effect {
 public:
  explicit TangentialDistortion(const EffectSetup&)
      : Effect({{"p1", "", 0.01, -0.02, 0.02}, {"p2", "", 0.01, -0.02, 0.02}}) {}
  void ChangeLens(const Observation&, LensColumns columns) const override {
    columns(kP1, 0) = 1.0;
    columns(kP2, 1) = 1.0;
  }
  bool is_constant_lens() const override { return true; }
};

}  // namespace

EffectEntry TangentialDistortionEntry() {
  return WithOneShape<TangentialDistortion>(
      {"tangential_distortion", ModelPart::kLens,
       "the lens is not centred or not parallel to the sensor, which bends one side of the "
       "picture more than the other",
       "declare the fitted p1, p2 in sensor.yaml's distortion_coefficients"},
      "radtan", [](const EffectSetup& setup) {
        return setup.has_pixels && setup.distortion_model != DistortionModel::kKannalaBrandt;
      });
}

}  // namespace camgyro
