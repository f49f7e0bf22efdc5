// Axes of the gyro that are not sampled at the same time, or attitudes of a rolling-shutter camera
// that follow rotation about each axis at another time.
#include "core/effects/entries.h"
#include "core/effects/rate_derivatives.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// reading_k(t) = rate_k(t - d_k); d_x is part of t_d.
class GyroAxisDelay final : public Effect {
 public:
  explicit GyroAxisDelay(const EffectSetup& setup)
      : Effect({{"y_after_x", "s", 0.01, -0.05, 0.05}, {"z_after_x", "s", 0.01, -0.05, 0.05}}),
        derivatives_(setup, RateDerivatives::kFirst) {}
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at < 0) return;
    const Eigen::Vector3d slope = derivatives_.At(at);
    columns(1, 0) = -slope.y();
    columns(2, 1) = -slope.z();
  }

 private:
  const RateDerivatives derivatives_;
};

}  // namespace

EffectEntry GyroAxisDelayEntry() {
  return WithOneShape<GyroAxisDelay>(
      {"gyro_axis_delay", ModelPart::kRate,
       "rotation about the three axes is seen at different times: the gyro's axes are not sampled "
       "together, or attitudes come from a rolling shutter",
       "shift the gyro's axes in time by these delays"},
      "constant", RateDerivatives::Possible);
}

}  // namespace camgyro
