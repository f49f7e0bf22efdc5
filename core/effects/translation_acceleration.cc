// A path that bends within a pair of frames: shaky hands and near points.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// 0.7 rad within a pair of neighbours at 30 frames per second: any direction that the path can
// take.
constexpr double kFreeTurnRadS = 20.0;

// Every pair has a turn of its direction already, with a narrow prior
// (factors/coplanarity_plane.h); the effect widens it. No parameters of its own.
class TranslationAcceleration final : public Effect {
 public:
  explicit TranslationAcceleration(const EffectSetup&) : Effect({}) {}
  double widened_sigma(PairLatent latent) const override {
    return latent == PairLatent::kTurn ? kFreeTurnRadS : 0.0;
  }
};

}  // namespace

EffectEntry TranslationAccelerationEntry() {
  return WithOneShape<TranslationAcceleration>(
      {"translation_acceleration", ModelPart::kBaseline,
       "the camera's path bends strongly within a pair of frames: shaky hands and near points",
       "hold the camera more calmly, or look at things further away"},
      "turn", NeedsPixels);
}

}  // namespace camgyro
