// Axes of the gyro that are not sampled at the same time, or attitudes of a rolling-shutter camera
// that follow rotation about each axis at another time.
#include <algorithm>

#include "core/effects/entries.h"
#include "core/effects/rate_derivatives.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// reading_k(t) = rate_k(t - d_k), so that it is off by reading_k(t) - reading_k(t + d_k); d_x is
// part of t_d. Beyond the reach of the derivatives the change goes on straight.
class GyroAxisDelay final : public Effect {
 public:
  explicit GyroAxisDelay(const EffectSetup& setup)
      : Effect({{"y_after_x", "s", 0.01, -0.05, 0.05}, {"z_after_x", "s", 0.01, -0.05, 0.05}}),
        derivatives_(setup) {}
  Eigen::Vector3d ChangeRateBy(double time_s, const Eigen::Vector3d&, const double* values,
                               RateColumns columns) const override {
    Eigen::Vector3d change = Eigen::Vector3d::Zero();
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at < 0) return change;
    const RateDerivatives::Coefficients all = derivatives_.At(at);
    for (int k = 0; k < 2; ++k) {
      const auto c = all.col(k + 1);
      const double d = std::clamp(values[k], -RateDerivatives::kReach_s, RateDerivatives::kReach_s);
      columns(k + 1, k) = -(c[1] + d * (2.0 * c[2] + d * (3.0 * c[3] + 4.0 * d * c[4])));
      change[k + 1] =
          -d * (c[1] + d * (c[2] + d * (c[3] + d * c[4]))) + (values[k] - d) * columns(k + 1, k);
    }
    return change;
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
