// When a solve has moved by so little that it may stop.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_YARDSTICK_H_
#define CAMGYRO_ESTIMATOR_WINDOW_YARDSTICK_H_

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "core/calibration.h"
#include "core/linear_algebra.h"
#include "estimator/window/frame_times.h"

namespace camgyro {

// Steps of the state are measured in sigmas, all of it together. A step below this is the last one:
// steps shrink by a factor of 1.5 to 5 each, so what is left is as much or twice as much, and that
// of a state of 11 and more numbers.
constexpr double kSettledStep = 0.1;

// How far two states are apart, with their effects, in sigmas: the Mahalanobis distance.
class Yardstick {
 public:
  // covariance: of the state and the effects.
  explicit Yardstick(const Eigen::MatrixXd& covariance);
  double Distance(const Calibration& a, const Calibration& b) const;

 private:
  SymmetricSolver covariance_;
};

// Whether nine tenths of the frames' own times [s], by frame, have moved by less than kSettledStep
// of their sigmas, which are those of `known`. The others are those of pairs with several minima,
// which creep for long.
bool FrameTimesHaveSettled(const std::vector<FrameOffset>& known,
                           const std::map<int64_t, double>& before_s,
                           const std::map<int64_t, double>& now_s);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_YARDSTICK_H_
