#include "core/effects/rate_derivatives.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace camgyro {

RateDerivatives::RateDerivatives(const EffectSetup& setup, Order order)
    : times_s(setup.gyro_times_s) {
  const auto n = static_cast<Eigen::Index>(times_s.size());
  values.setZero(3, n);
  const double interval = (times_s.back() - times_s.front()) / static_cast<double>(n - 1);
  const auto half = std::max<Eigen::Index>(2, std::llround(0.025 / interval));
  const double unit = static_cast<double>(half) * interval;
  for (Eigen::Index i = half; i + half < n; ++i) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d B = Eigen::Matrix3d::Zero();  // row: power, column: axis
    for (Eigen::Index j = i - half; j <= i + half; ++j) {
      const double t = (times_s[static_cast<size_t>(j)] - times_s[static_cast<size_t>(i)]) / unit;
      const Eigen::Vector3d powers(1.0, t, t * t);
      A += powers * powers.transpose();
      B += powers * setup.gyro_rad_s.col(j).transpose();
    }
    const Eigen::Matrix3d coefficients = A.inverse() * B;
    const double scale = order == kFirst ? 1.0 / unit : 2.0 / (unit * unit);
    values.col(i) = scale * coefficients.row(order).transpose();
  }
}

Eigen::Index RateDerivatives::At(double time_gyro_s) const {
  const auto it = std::lower_bound(times_s.begin(), times_s.end(), time_gyro_s - 1e-9);
  return it == times_s.end() ? -1 : it - times_s.begin();
}

bool RateDerivatives::Possible(const EffectSetup& setup) {
  const size_t n = setup.gyro_times_s.size();
  return n > 20 && setup.gyro_times_s.back() - setup.gyro_times_s.front() <
                       0.025 * (static_cast<double>(n) - 1.0);
}

}  // namespace camgyro
