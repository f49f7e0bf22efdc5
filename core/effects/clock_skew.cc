// Two crystals: the delay grows with time.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class ClockSkew final : public Effect {
 public:
  explicit ClockSkew(const EffectSetup& setup)
      : Effect({{"skew", "ppm", 300.0, -2000.0, 2000.0}}), delay_s_(setup.delay_s) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    columns(0, 0) = 1e-6 * (o.frame.stamp_s + delay_s_);
  }

 private:
  const double delay_s_;
};

}  // namespace

// The delay is then that at the first gyro stamp.
EffectEntry ClockSkewEntry() {
  return WithOneShape<ClockSkew>(
      {"clock_skew", ModelPart::kShutterClock,
       "camera and gyro are timed by clocks of different speed: the delay grows steadily",
       "multiply camera time by (1 + skew), or re-estimate the delay all the time"},
      "constant", AlwaysShown);
}

}  // namespace camgyro
