// From one frame on the stamps are off: dropped or re-stamped frames.
#include <cstdlib>

#include "core/effects/entries.h"

namespace camgyro {
namespace {

class DelayStep final : public Effect {
 public:
  explicit DelayStep(double stamp_s)
      : Effect({{"step", "s", 0.02, -0.2, 0.2}}), stamp_s_(stamp_s) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    columns(0, 0) = o.frame.stamp_s >= stamp_s_ ? 1.0 : 0.0;
  }

 private:
  const double stamp_s_;
};

}  // namespace

// Shape: the stamp of the first frame after the step [s after the first gyro stamp]. shapes() lists
// none: the time is searched by estimator/diagnosis/.
EffectEntry DelayStepEntry() {
  EffectEntry entry = {"delay_step",
                       ModelPart::kShutterClock,
                       "from one frame on all stamps are shifted: a frame was dropped or stamped "
                       "anew",
                       "look for lost frames at that time; calibrate the parts before and after "
                       "separately, or shift the stamps",
                       {},
                       {}};
  entry.shapes = [](const EffectSetup&) { return std::vector<std::string>{}; };
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    char* end = nullptr;
    const double stamp_s = std::strtod(shape.c_str(), &end);
    if (shape.empty() || *end != 0 || stamp_s <= setup.frames.front().stamp_s ||
        stamp_s > setup.frames.back().stamp_s) {
      return nullptr;
    }
    return std::make_shared<DelayStep>(stamp_s);
  };
  return entry;
}

}  // namespace camgyro
