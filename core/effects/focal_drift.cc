// A focal length that changes with time: autofocus, warmth.
#include "core/effects/entries.h"
#include "core/effects/time_curve.h"

namespace camgyro {
namespace {

class LinearFocalDrift final : public Effect {
 public:
  explicit LinearFocalDrift(const EffectSetup& setup)
      : Effect({{"rate", "px/s", 2.0, -10.0, 10.0}}), delay_s_(setup.delay_s) {}
  void ChangeLens(const Observation& o, LensColumns columns) const override {
    columns(kFocal, 0) = o.frame.stamp_s + delay_s_;
  }

 private:
  const double delay_s_;
};

// Focal length of the rows over time, less its value at the start.
class FocalCurve final : public Effect {
 public:
  FocalCurve(const EffectSetup& setup, const TimeCurve& curve)
      : Effect(Parameters(curve)), curve_(curve), delay_s_(setup.delay_s) {}
  void ChangeLens(const Observation& o, LensColumns columns) const override {
    curve_.At(o.frame.stamp_s + delay_s_,
              [&](int i, double weight) { columns(kFocal, i) += weight; });
  }

 private:
  static std::vector<EffectParameter> Parameters(const TimeCurve& curve) {
    std::vector<EffectParameter> parameters;
    for (int i = 0; i < curve.size(); ++i) {
      parameters.push_back({"df_" + std::to_string(i + 1), "px", 20.0, -100.0, 100.0});
    }
    return parameters;
  }
  const TimeCurve curve_;
  const double delay_s_;
};

}  // namespace

// Shapes: linear (f at the first gyro stamp, and its rate), curve (a spline over the recording).
EffectEntry FocalDriftEntry() {
  EffectEntry entry = {"focal_drift", ModelPart::kLens,
                       "the focal length changes during the recording: the lens refocuses or "
                       "grows warm",
                       "lock the focus; else use f as a function of time"};
  entry.shapes = [](const EffectSetup& setup) {
    return setup.has_pixels ? std::vector<std::string>{"linear", "curve"}
                            : std::vector<std::string>{};
  };
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    if (!setup.has_pixels) return nullptr;
    if (shape == "linear") return std::make_shared<LinearFocalDrift>(setup);
    if (shape != "curve") return nullptr;
    return std::make_shared<FocalCurve>(setup, TimeCurve(setup.from_s(), setup.to_s(), 2.0, 20));
  };
  return entry;
}

}  // namespace camgyro
