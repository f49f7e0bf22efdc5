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

RateDerivatives::RateDerivatives(const EffectSetup& setup)
    : gyro_(setup.gyro),
      half_(std::max<Eigen::Index>(3, std::llround(kReach_s / MeanInterval(gyro_->times_s)))),
      unit_s_(static_cast<double>(half_) * MeanInterval(gyro_->times_s)) {}

Eigen::Index RateDerivatives::IndexAt(double time_gyro_s) const {
  const std::vector<double>& times_s = gyro_->times_s;
  const auto it = std::lower_bound(times_s.begin(), times_s.end(), time_gyro_s - 1e-9);
  return it == times_s.end() ? -1 : it - times_s.begin();
}

RateDerivatives::Coefficients RateDerivatives::At(Eigen::Index sample) const {
  const std::vector<double>& times_s = gyro_->times_s;
  if (sample < half_ || sample + half_ >= static_cast<Eigen::Index>(times_s.size())) {
    return Coefficients::Zero();
  }
  Eigen::Matrix<double, 5, 5> A = Eigen::Matrix<double, 5, 5>::Zero();
  Coefficients B = Coefficients::Zero();
  for (Eigen::Index j = sample - half_; j <= sample + half_; ++j) {
    const double t =
        (times_s[static_cast<size_t>(j)] - times_s[static_cast<size_t>(sample)]) / unit_s_;
    const Eigen::Matrix<double, 5, 1> powers(1.0, t, t * t, t * t * t, t * t * t * t);
    A += powers * powers.transpose();
    B += powers * gyro_->values.col(j).transpose();
  }
  Coefficients coefficients = A.ldlt().solve(B);
  double power = 1.0;
  for (int k = 1; k < coefficients.rows(); ++k) {
    power /= unit_s_;
    coefficients.row(k) *= power;
  }
  return coefficients;
}

bool RateDerivatives::Possible(const EffectSetup& setup) {
  const std::vector<double>& times_s = setup.gyro->times_s;
  return times_s.size() > 20 && MeanInterval(times_s) < 0.025;
}

}  // namespace camgyro
