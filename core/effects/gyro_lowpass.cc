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
//   reading(t) - reading(t - T) - T reading'(t - T)
//     = T^2/2 reading'' - T^3/3 reading''' + T^4/8 reading'''' - ...
// The parameter is T^2. Below zero, where there is no filter, and beyond the reach of the
// derivatives the change goes on straight.
class GyroLowpass final : public Effect {
 public:
  explicit GyroLowpass(const EffectSetup& setup)
      : Effect({{"time_constant_sq", "s^2", 4e-4, 0.0, 4e-3}}), derivatives_(setup) {}
  Eigen::Vector3d ChangeRateBy(double time_s, const Eigen::Vector3d&, const double* values,
                               RateColumns columns) const override {
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at < 0) return Eigen::Vector3d::Zero();
    const RateDerivatives::Coefficients c = derivatives_.At(at);
    const double T = std::min(std::sqrt(std::max(0.0, values[0])), RateDerivatives::kReach_s);
    columns = (c.row(2) - T * (3.0 * c.row(3) - 6.0 * T * c.row(4))).transpose();
    const Eigen::Vector3d of_T =
        T * T * (c.row(2) - T * (2.0 * c.row(3) - 3.0 * T * c.row(4))).transpose();
    return of_T + (values[0] - T * T) * columns.col(0);
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
