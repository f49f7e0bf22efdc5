// Rows that are not read evenly.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// t += bend * 4 s (1 - s), s = v / h: the middle row is late by `bend`.
class ReadoutNonlinear final : public Effect {
 public:
  explicit ReadoutNonlinear(const EffectSetup&) : Effect({{"bend", "s", 0.003, -0.01, 0.01}}) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    const double s = o.px.y() / o.size_px.y();
    columns(0, 0) = 4.0 * s * (1.0 - s);
    columns(2, 0) = 4.0 * (1.0 - 2.0 * s) / o.size_px.y();
  }
};

}  // namespace

EffectEntry ReadoutNonlinearEntry() {
  return WithOneShape<ReadoutNonlinear>(
      {"readout_nonlinear", ModelPart::kShutterClock,
       "rows are not read at an even pace: the middle row comes early or late",
       "look for a video mode with binning, pauses or several exposures per frame"},
      "bend", NeedsPixels);
}

}  // namespace camgyro
