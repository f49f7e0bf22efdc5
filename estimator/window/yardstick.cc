#include "estimator/window/yardstick.h"

#include <cmath>

namespace camgyro {

Yardstick::Yardstick(const Eigen::MatrixXd& covariance) : covariance_(covariance) {}

double Yardstick::Distance(const Calibration& a, const Calibration& b) const {
  Eigen::VectorXd d(kStateSize + a.effect_values.size());
  d << Difference(a, b), a.effect_values - b.effect_values;
  return std::sqrt(std::abs(d.dot(covariance_.Solve(d).col(0))));
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
