#include "estimator/window/yardstick.h"

#include <cmath>

namespace camgyro {

// Unit diagonal before the factorisation: the units differ by orders of magnitude.
Yardstick::Yardstick(const Eigen::MatrixXd& covariance)
    : scale_(covariance.diagonal().cwiseSqrt().cwiseInverse()),
      correlation_(scale_.asDiagonal() * covariance * scale_.asDiagonal()) {}

double Yardstick::Distance(const Calibration& a, const Calibration& b) const {
  Eigen::VectorXd d(scale_.size());
  d.head<kStateSize>() = Difference(a, b);
  d.tail(d.size() - kStateSize) = a.effect_values - b.effect_values;
  d = scale_.cwiseProduct(d);
  return std::sqrt(std::abs(d.dot(correlation_.solve(d))));
}

bool FrameTimesHaveSettled(const std::vector<FrameOffset>& known,
                           const std::map<int64_t, double>& before_s,
                           const std::map<int64_t, double>& now_s) {
  size_t settled = 0;
  for (const FrameOffset& frame : known) {
    const double moved_s = std::abs(now_s.at(frame.frame) - before_s.at(frame.frame));
    settled += moved_s < kSettledStep * frame.sigma_s ? 1 : 0;
  }
  return 10 * settled >= 9 * known.size();
}

}  // namespace camgyro
