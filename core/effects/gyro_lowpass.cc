// The gyro's digital low-pass.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/effects/entries.h"

namespace camgyro {
namespace {

// A first-order low-pass delays by its time constant T, which is part of t_d, and attenuates to
// second order: rate(t) = reading(t + T) - T^2/2 reading''(t). The parameter is T^2. What the
// linear form neglects, T^3/6 reading''', is 3e-4 of the rate for T = 8 ms at 2.5 Hz.
class GyroLowpass final : public Effect {
 public:
  explicit GyroLowpass(const EffectSetup& setup)
      : Effect({{"time_constant_sq", "s^2", 4e-4, 0.0, 4e-3}}), times_s_(setup.gyro_times_s) {
    // Second derivative: least-squares parabola over 25 ms to both sides, at least 2 samples.
    const auto n = static_cast<Eigen::Index>(times_s_.size());
    second_.setZero(3, n);
    const auto interval = (times_s_.back() - times_s_.front()) / static_cast<double>(n - 1);
    const auto half = std::max<Eigen::Index>(2, std::llround(0.025 / interval));
    for (Eigen::Index i = half; i + half < n; ++i) {
      Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
      Eigen::Matrix3d B = Eigen::Matrix3d::Zero();  // row: power, column: axis
      for (Eigen::Index j = i - half; j <= i + half; ++j) {
        const double t = (times_s_[static_cast<size_t>(j)] - times_s_[static_cast<size_t>(i)]) /
                         (static_cast<double>(half) * interval);
        const Eigen::Vector3d powers(1.0, t, t * t);
        A += powers * powers.transpose();
        B += powers * setup.gyro_rad_s.col(j).transpose();
      }
      const double unit = static_cast<double>(half) * interval;
      second_.col(i) = 2.0 / (unit * unit) * (A.inverse() * B).row(2).transpose();
    }
  }
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    const auto next = std::lower_bound(times_s_.begin(), times_s_.end(), time_s - 1e-9);
    if (next != times_s_.end()) columns = 0.5 * second_.col(next - times_s_.begin());
  }

 private:
  const std::vector<double> times_s_;
  Eigen::Matrix3Xd second_;
};

}  // namespace

// Shape: first_order. Needs samples every 25 ms or faster.
EffectEntry GyroLowpassEntry() {
  EffectEntry entry = {"gyro_lowpass",
                       ModelPart::kRate,
                       "the gyro's low-pass filter attenuates fast rotation, and delays the gyro "
                       "by its time constant (a part of the delay found)",
                       "set a wider bandwidth in the gyro; with another bandwidth the delay "
                       "changes by the difference of the time constants",
                       {},
                       {}};
  entry.shapes = [](const EffectSetup& setup) {
    const size_t n = setup.gyro_times_s.size();
    const bool fast =
        n > 20 && setup.gyro_times_s.back() - setup.gyro_times_s.front() < 0.025 * (n - 1.0);
    return fast ? std::vector<std::string>{"first_order"} : std::vector<std::string>{};
  };
  entry.make = [shapes = entry.shapes](const EffectSetup& setup,
                                       const std::string& shape) -> std::shared_ptr<const Effect> {
    if (shape != "first_order" || shapes(setup).empty()) return nullptr;
    return std::make_shared<GyroLowpass>(setup);
  };
  return entry;
}

}  // namespace camgyro
