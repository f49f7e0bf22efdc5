// The gyro's digital low-pass.
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/effects/entries.h"
#include "core/effects/rate_derivatives.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// A first-order low-pass of time constant T: rate(t) = reading(t) + T reading'(t). It delays by T,
// which is part of t_d, so that readings of that clock are off by
//   reading(t) - reading(t - T) - T reading'(t - T) = T^2/2 reading'' - T^3/3 reading''' + ...
// The parameter is T^2.
class GyroLowpass final : public Effect {
 public:
  explicit GyroLowpass(const EffectSetup& setup) : GyroLowpass(RateDerivatives(setup), 0.0) {}
  // The column is the secant to this time constant.
  GyroLowpass(const RateDerivatives& derivatives, double about_s)
      : Effect({{"time_constant_sq", "s^2", 4e-4, 0.0, 4e-3}}),
        derivatives_(derivatives),
        about_s_(about_s) {}
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at < 0) return;
    const RateDerivatives::Coefficients c = derivatives_.At(at);
    columns = (c.row(2) - about_s_ * (2.0 * c.row(3) - 3.0 * about_s_ * c.row(4))).transpose();
  }
  std::shared_ptr<const Effect> LinearAbout(const double* values) const override {
    // What is neglected delays a rotation of 4 Hz by (2 pi 4 Hz)^2 T^3/3 = 13 us for 4 ms.
    constexpr double kLinear_s = 4e-3;
    constexpr double kSame_s = 2e-5;  // below its sigma in 40 s of running
    const double to_s = std::min(std::sqrt(std::max(0.0, values[0])), RateDerivatives::kReach_s);
    if (std::abs(to_s - about_s_) < (about_s_ == 0.0 ? kLinear_s : kSame_s)) return nullptr;
    return std::make_shared<GyroLowpass>(derivatives_, to_s);
  }

 private:
  const RateDerivatives derivatives_;
  const double about_s_;
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
