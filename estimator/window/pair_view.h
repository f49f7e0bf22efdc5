// One pair of frames under a given calibration, outside of any solve: the rates are the gyro's.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PAIR_VIEW_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PAIR_VIEW_H_

#include <Eigen/Core>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "factors/pair_bearings.h"

namespace camgyro {

struct PairView {
  PairMeasurement measurement;  // those matches that have rays; rates in one group
  Eigen::Matrix3Xd rates;       // readings less bias and effects [rad/s]
  PairBearings bearings;        // with derivatives
};

// False where the gyro's samples do not cover the pair. noise: pixels. Shutter, lens, effects and
// bias are the calibration's.
[[nodiscard]] bool ViewPair(const EstimationInput& input, const TimedPair& pair,
                            const Calibration& calibration, double noise_px,
                            const PairGraphOptions& options, PairView* view);

// The samples that a pair needs, and one beyond on both sides; false where there are none, or a
// gap is longer than 5 median intervals and 30 ms.
[[nodiscard]] bool RatesOfPair(const EstimationInput& input, const TimedPair& pair,
                               const Calibration& calibration, std::vector<double>* times_s,
                               Eigen::Matrix3Xd* rates);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PAIR_VIEW_H_
