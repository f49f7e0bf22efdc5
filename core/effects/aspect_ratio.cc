// Pixels that are not square.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class AspectRatio final : public Effect {
 public:
  explicit AspectRatio(const EffectSetup&)
      : Effect({{"aspect_ratio_change", "", 0.05, -0.35, 0.35}}) {}
  void ChangeLens(const Observation&, LensColumns columns) const override {
    columns(kAspect, 0) = 1.0;
  }
  bool is_constant_lens() const override { return true; }
};

}  // namespace

EffectEntry AspectRatioEntry() {
  return WithOneShape<AspectRatio>(
      {"aspect_ratio", ModelPart::kLens,
       "width and height of the picture are scaled differently: the pixels are not square",
       "look for a video mode that crops or scales one direction; use fx = aspect_ratio * f"},
      "constant", NeedsPixels);
}

}  // namespace camgyro
