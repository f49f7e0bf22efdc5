// From one frame on the stamps are off: dropped or re-stamped frames.
#include <cmath>
#include <cstdlib>

#include "core/effects/entries.h"
#include "core/format.h"

namespace camgyro {
namespace {

class DelayStep final : public Effect {
 public:
  explicit DelayStep(double stamp_s)
      : Effect({{"step", "s", 0.02, -0.2, 0.2}}), stamp_s_(stamp_s) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    columns(0, 0) = o.frame.stamp_s >= stamp_s_ ? 1.0 : 0.0;
  }
  std::optional<double> first_stamp_s() const override { return stamp_s_; }

 private:
  const double stamp_s_;
};

// The shape's number, rounded down to what its name holds: after the last frame there is no step.
std::string NameOf(double stamp_s) { return Format("%.4f", std::floor(1e4 * stamp_s) * 1e-4); }

std::shared_ptr<const Effect> Make(const EffectSetup& setup, const std::string& shape) {
  char* end = nullptr;
  const double stamp_s = std::strtod(shape.c_str(), &end);
  if (shape.empty() || *end != 0 || stamp_s <= setup.frames.front().stamp_s ||
      stamp_s > setup.frames.back().stamp_s) {
    return nullptr;
  }
  return std::make_shared<DelayStep>(stamp_s);
}

}  // namespace

// Shape: the stamp of the first frame after the step [s after the first gyro stamp]. shapes() lists
// none: the time is searched by estimator/diagnosis/.
EffectEntry DelayStepEntry() {
  EffectEntry entry = {"delay_step", ModelPart::kShutterClock,
                       "from one frame on all stamps are shifted: a frame was dropped or stamped "
                       "anew",
                       "look for lost frames at that time; calibrate the parts before and after "
                       "separately, or shift the stamps"};
  entry.shapes = [](const EffectSetup&) { return std::vector<std::string>{}; };
  entry.make = Make;
  entry.step_at = [](const EffectSetup& setup, double stamp_s) {
    const std::string shape = NameOf(stamp_s);
    return ShapedEffect{shape, Make(setup, shape)};
  };
  entry.adds_up = true;
  return entry;
}

}  // namespace camgyro
