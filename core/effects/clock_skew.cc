// Two crystals, a nominal rate, or a clock that was found behind stamps: the delay grows with time.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/effects/entries.h"

namespace camgyro {
namespace {

// Crystals differ by up to 300 ppm; a logger that counts samples of a nominal rate (an action
// camera's "400 Hz" is 403.8 Hz) makes a clock that is off by some percent, which the start finds.
constexpr double kCrystalPpm = 300.0, kLoggerPpm = 25000.0;

class ClockSkew final : public Effect {
 public:
  // The delay is that at from_s after the first gyro stamp.
  ClockSkew(double spread_ppm, double start_ppm, double delay_s, double from_s)
      : Effect({{"skew", "ppm", spread_ppm, -kLoggerPpm, kLoggerPpm}}),
        start_ppm_(start_ppm),
        from_s_(from_s - delay_s) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    columns(0, 0) = 1e-6 * (o.frame.stamp_s - from_s_);
  }
  void SetStart(double* values) const override { values[0] = start_ppm_; }

 private:
  const double start_ppm_, from_s_;  // the latter by the camera's clock
};

std::shared_ptr<const Effect> MakeClockSkew(const EffectSetup& setup, const std::string& shape) {
  if (shape == "constant") {
    const double start_ppm = 1e6 * setup.clock_skew;
    return std::make_shared<ClockSkew>(std::max(kCrystalPpm, std::abs(start_ppm)), start_ppm,
                                       setup.delay_s, 0.0);
  }
  char* end = nullptr;
  const double known_ppm = std::strtod(shape.c_str(), &end);
  if (shape.empty() || *end != 0 || !(known_ppm > 0.0 && known_ppm <= kLoggerPpm) ||
      setup.gyro->times_s.empty()) {
    return nullptr;
  }
  return std::make_shared<ClockSkew>(std::hypot(kCrystalPpm, known_ppm), 0.0, setup.delay_s,
                                     0.5 * setup.gyro->times_s.back());
}

}  // namespace

// Shape: constant, the delay being that at the first gyro stamp; or how well the rate of a clock is
// known that was found behind the gyro's stamps [ppm], the delay being that in the middle of them,
// where it does not depend on the rate. shapes() lists the first: the other one is taken by
// estimator/starting_point.h.
EffectEntry ClockSkewEntry() {
  EffectEntry entry = {
      "clock_skew", ModelPart::kShutterClock,
      "camera and gyro are timed by clocks of different speed: the delay grows steadily",
      "multiply camera time by (1 + skew), or re-estimate the delay all the time"};
  entry.shapes = [](const EffectSetup&) { return std::vector<std::string>{"constant"}; };
  entry.make = MakeClockSkew;
  entry.found_at_start = [](const EffectSetup& setup) { return setup.clock_skew != 0.0; };
  return entry;
}

}  // namespace camgyro
