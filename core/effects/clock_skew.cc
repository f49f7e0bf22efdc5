// Two crystals, or a nominal rate: the delay grows with time.
#include <algorithm>
#include <cmath>

#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// Crystals differ by up to 300 ppm; a logger that counts samples of a nominal rate (an action
// camera's "400 Hz" is 403.8 Hz) makes a clock that is off by some percent, which the start finds.
constexpr double kCrystalPpm = 300.0, kLoggerPpm = 25000.0;

class ClockSkew final : public Effect {
 public:
  explicit ClockSkew(const EffectSetup& setup)
      : Effect({{"skew", "ppm", std::max(kCrystalPpm, 1e6 * std::abs(setup.clock_skew)),
                 -kLoggerPpm, kLoggerPpm}}),
        delay_s_(setup.delay_s),
        start_ppm_(1e6 * setup.clock_skew) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    columns(0, 0) = 1e-6 * (o.frame.stamp_s + delay_s_);
  }
  void SetStart(double* values) const override { values[0] = start_ppm_; }

 private:
  const double delay_s_, start_ppm_;
};

}  // namespace

// The delay is then that at the first gyro stamp.
EffectEntry ClockSkewEntry() {
  EffectEntry entry = WithOneShape<ClockSkew>(
      {"clock_skew", ModelPart::kShutterClock,
       "camera and gyro are timed by clocks of different speed: the delay grows steadily",
       "multiply camera time by (1 + skew), or re-estimate the delay all the time"},
      "constant", AlwaysShown);
  entry.found_at_start = [](const EffectSetup& setup) { return setup.clock_skew != 0.0; };
  return entry;
}

}  // namespace camgyro
