// The gyro's digital low-pass.
#include "core/effects/entries.h"
#include "core/effects/rate_derivatives.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// A first-order low-pass delays by its time constant T, which is part of t_d, and attenuates to
// second order: rate(t) = reading(t + T) - T^2/2 reading''(t). The parameter is T^2. What the
// linear form neglects, T^3/6 reading''', is 3e-4 of the rate for T = 8 ms at 2.5 Hz.
class GyroLowpass final : public Effect {
 public:
  explicit GyroLowpass(const EffectSetup& setup)
      : Effect({{"time_constant_sq", "s^2", 4e-4, 0.0, 4e-3}}),
        derivatives_(setup, RateDerivatives::kSecond) {}
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at >= 0) columns = 0.5 * derivatives_.At(at);
  }

 private:
  const RateDerivatives derivatives_;
};

}  // namespace

EffectEntry GyroLowpassEntry() {
  return WithOneShape<GyroLowpass>(
      {"gyro_lowpass", ModelPart::kRate,
       "the gyro's low-pass filter attenuates fast rotation, and delays the gyro by its time "
       "constant (a part of the delay found)",
       "set a wider bandwidth in the gyro; with another bandwidth the delay changes by the "
       "difference of the time constants"},
      "first_order", RateDerivatives::Possible);
}

}  // namespace camgyro
