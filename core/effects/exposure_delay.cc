// Stamps of the exposure's start: its middle comes later by half of an exposure that varies.
#include <algorithm>
#include <cmath>

#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class ExposureDelay final : public Effect {
 public:
  explicit ExposureDelay(const EffectSetup&) : Effect({{"factor", "", 1.0, -1.5, 1.5}}) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    if (std::isfinite(o.frame.exposure_s)) columns(0, 0) = o.frame.exposure_s;
  }
};

// Exposures of all frames that vary by more than 2 %.
bool ExposuresVary(const EffectSetup& setup) {
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const FrameTime& frame : setup.frames) {
    if (!std::isfinite(frame.exposure_s)) return false;
    low = std::min(low, frame.exposure_s);
    high = std::max(high, frame.exposure_s);
  }
  return high - low > 0.02 * high;
}

}  // namespace

EffectEntry ExposureDelayEntry() {
  return WithOneShape<ExposureDelay>(
      {"exposure_delay", ModelPart::kShutterClock,
       "the stamps mark a moment of the exposure other than its middle, so that the delay "
       "follows the exposure time",
       "add factor * exposure to each stamp (0.5: the stamps are starts of the exposure)"},
      "factor", ExposuresVary);
}

}  // namespace camgyro
