// A delay that moves slowly to and fro.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"
#include "core/effects/time_curve.h"

namespace camgyro {
namespace {

class DelayWander final : public Effect {
 public:
  explicit DelayWander(const EffectSetup& setup) : DelayWander(setup, Curve(setup)) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    curve_.At(o.frame.stamp_s + delay_s_, [&](int i, double weight) { columns(0, i) += weight; });
  }

 private:
  DelayWander(const EffectSetup& setup, const TimeCurve& curve)
      : Effect(Parameters(curve)), curve_(curve), delay_s_(setup.delay_s) {}
  static TimeCurve Curve(const EffectSetup& setup) {
    return TimeCurve(setup.from_s(), setup.to_s(), 1.7, 24);
  }
  static std::vector<EffectParameter> Parameters(const TimeCurve& curve) {
    std::vector<EffectParameter> parameters;
    for (int i = 0; i < curve.size(); ++i) {
      parameters.push_back({"delay_" + std::to_string(i + 1), "s", 8e-3, -0.2, 0.2});
    }
    return parameters;
  }
  const TimeCurve curve_;
  const double delay_s_;
};

}  // namespace

EffectEntry DelayWanderEntry() {
  return WithOneShape<DelayWander>(
      {"delay_wander", ModelPart::kShutterClock,
       "the delay between camera and gyro moves slowly to and fro",
       "look for stamps that are taken when a frame arrives, and for an exposure control; use "
       "the delay as a function of time"},
      "curve", AlwaysShown);
}

}  // namespace camgyro
