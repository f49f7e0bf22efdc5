#include "core/effects/rate_derivatives.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace camgyro {
namespace {

double MeanInterval(const std::vector<double>& times_s) {
  return (times_s.back() - times_s.front()) / (static_cast<double>(times_s.size()) - 1.0);
}

}  // namespace

RateDerivatives::RateDerivatives(const EffectSetup& setup, Order order)
    : gyro_(setup.gyro),
      order_(order),
      half_(std::max<Eigen::Index>(3, std::llround(0.04 / MeanInterval(gyro_->times_s)))),
      unit_s_(static_cast<double>(half_) * MeanInterval(gyro_->times_s)) {}

Eigen::Index RateDerivatives::IndexAt(double time_gyro_s) const {
  const std::vector<double>& times_s = gyro_->times_s;
  const auto it = std::lower_bound(times_s.begin(), times_s.end(), time_gyro_s - 1e-9);
  return it == times_s.end() ? -1 : it - times_s.begin();
}

Eigen::Vector3d RateDerivatives::At(Eigen::Index sample) const {
  const std::vector<double>& times_s = gyro_->times_s;
  if (sample < half_ || sample + half_ >= static_cast<Eigen::Index>(times_s.size())) {
    return Eigen::Vector3d::Zero();
  }
  Eigen::Matrix<double, 5, 5> A = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 3> B = Eigen::Matrix<double, 5, 3>::Zero();  // row: power, column: axis
  for (Eigen::Index j = sample - half_; j <= sample + half_; ++j) {
    const double t =
        (times_s[static_cast<size_t>(j)] - times_s[static_cast<size_t>(sample)]) / unit_s_;
    const Eigen::Matrix<double, 5, 1> powers(1.0, t, t * t, t * t * t, t * t * t * t);
    A += powers * powers.transpose();
    B += powers * gyro_->values.col(j).transpose();
  }
  const Eigen::Matrix<double, 5, 3> coefficients = A.ldlt().solve(B);
  const double scale = order_ == kFirst ? 1.0 / unit_s_ : 2.0 / (unit_s_ * unit_s_);
  return scale * coefficients.row(order_).transpose();
}

bool RateDerivatives::Possible(const EffectSetup& setup) {
  const std::vector<double>& times_s = setup.gyro->times_s;
  return times_s.size() > 20 && MeanInterval(times_s) < 0.025;
}

}  // namespace camgyro
