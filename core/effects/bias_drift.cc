// A bias that changes with time, as the device warms up.
#include "core/effects/entries.h"
#include "core/effects/time_curve.h"

namespace camgyro {
namespace {

const char* const kAxes[3] = {"x", "y", "z"};

class LinearBiasDrift final : public Effect {
 public:
  explicit LinearBiasDrift(double middle_s) : Effect(Parameters()), middle_s_(middle_s) {}
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    columns = (time_s - middle_s_) * Eigen::Matrix3d::Identity();
  }

 private:
  static std::vector<EffectParameter> Parameters() {
    std::vector<EffectParameter> parameters;
    for (const char* axis : kAxes) {
      parameters.push_back({std::string("rate_") + axis, "rad/s^2", 1e-3, -0.01, 0.01});
    }
    return parameters;
  }
  const double middle_s_;
};

class BiasCurve final : public Effect {
 public:
  explicit BiasCurve(const TimeCurve& curve) : Effect(Parameters(curve)), curve_(curve) {}
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    curve_.At(time_s, [&](int i, double weight) {
      columns.middleCols<3>(3 * i) += weight * Eigen::Matrix3d::Identity();
    });
  }

 private:
  static std::vector<EffectParameter> Parameters(const TimeCurve& curve) {
    std::vector<EffectParameter> parameters;
    for (int i = 0; i < curve.size(); ++i) {
      for (const char* axis : kAxes) {
        parameters.push_back({axis + ("_" + std::to_string(i + 1)), "rad/s", 0.02, -0.2, 0.2});
      }
    }
    return parameters;
  }
  const TimeCurve curve_;
};

}  // namespace

// Shapes: linear (the bias is then that in the middle of the recording), curve (a spline).
EffectEntry BiasDriftEntry() {
  EffectEntry entry = {"bias_drift", ModelPart::kRate,
                       "the gyro's bias changes during the recording: the device warms up",
                       "let the device run for some minutes first; use the bias as a function of "
                       "time"};
  entry.shapes = [](const EffectSetup&) { return std::vector<std::string>{"linear", "curve"}; };
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    if (shape == "linear") {
      return std::make_shared<LinearBiasDrift>(0.5 * (setup.from_s() + setup.to_s()));
    }
    if (shape != "curve") return nullptr;
    return std::make_shared<BiasCurve>(TimeCurve(setup.from_s(), setup.to_s(), 4.0, 10));
  };
  return entry;
}

}  // namespace camgyro
