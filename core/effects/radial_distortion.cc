// Straight lines are imaged bent, alike in all directions from the principal point.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class RadialDistortion final : public Effect {
 public:
  explicit RadialDistortion(const EffectSetup&)
      : Effect({{"k1", "", 0.3, -0.6, 0.4}, {"k2", "", 0.3, -1.0, 1.0}}) {}
  void ChangeLens(const Observation&, LensColumns columns) const override {
    columns(kK1, 0) = 1.0;
    columns(kK2, 1) = 1.0;
  }
  bool is_constant_lens() const override { return true; }
};

}  // namespace

EffectEntry RadialDistortionEntry() {
  return WithOneShape<RadialDistortion>(
      {"radial_distortion",
       ModelPart::kLens,
       "the lens bends straight lines: the picture is stretched or squeezed towards its edge",
       "declare the fitted distortion_coefficients in sensor.yaml, and use them wherever the "
       "focal length is used",
       {},
       {}},
      "radtan", NeedsPixels);
}

}  // namespace camgyro
