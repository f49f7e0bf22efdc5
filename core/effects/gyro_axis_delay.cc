// Axes of the gyro that are not sampled at the same time, or attitudes of a rolling-shutter camera
// that follow rotation about each axis at another time.
#include <memory>

#include "core/effects/entries.h"
#include "core/effects/rate_derivatives.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// reading_k(t) = rate_k(t - d_k), so that it is off by reading_k(t) - reading_k(t + d_k); d_x is
// part of t_d.
class GyroAxisDelay final : public Effect {
 public:
  explicit GyroAxisDelay(const EffectSetup& setup)
      : GyroAxisDelay(RateDerivatives(setup), Eigen::Array2d::Zero()) {}
  // The columns are secants to these delays [s].
  GyroAxisDelay(const RateDerivatives& derivatives, const Eigen::Array2d& about_s)
      : Effect({{"y_after_x", "s", 0.01, -0.05, 0.05}, {"z_after_x", "s", 0.01, -0.05, 0.05}}),
        derivatives_(derivatives),
        about_s_(about_s) {}
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at < 0) return;
    const RateDerivatives::Coefficients c = derivatives_.At(at);
    for (int k = 0; k < 2; ++k) {
      const double d = about_s_[k];
      columns(k + 1, k) = -(c(1, k + 1) + d * (c(2, k + 1) + d * (c(3, k + 1) + d * c(4, k + 1))));
    }
  }
  std::shared_ptr<const Effect> LinearAbout(const double* values) const override {
    // What is neglected of 0.5 ms is at 4 Hz 0.6 % of the change, and scales the rate by 8e-5.
    constexpr double kLinear_s = 5e-4;
    constexpr double kSame_s = 2e-5;  // below its sigma in 40 s of running
    const Eigen::Array2d to_s = Eigen::Array2d(values[0], values[1])
                                    .max(-RateDerivatives::kReach_s)
                                    .min(RateDerivatives::kReach_s);
    const double near_s = (about_s_ == 0.0).all() ? kLinear_s : kSame_s;
    if (((to_s - about_s_).abs() < near_s).all()) return nullptr;
    return std::make_shared<GyroAxisDelay>(derivatives_, to_s);
  }

 private:
  const RateDerivatives derivatives_;
  const Eigen::Array2d about_s_;
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
