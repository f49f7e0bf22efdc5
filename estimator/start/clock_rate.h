// Does one clock run faster than the other? From the delays of short stretches.
#ifndef CAMGYRO_ESTIMATOR_START_CLOCK_RATE_H_
#define CAMGYRO_ESTIMATOR_START_CLOCK_RATE_H_

#include "estimator/start/rate_alignment.h"

namespace camgyro {

// t_gyro - (first gyro stamp) = (t_camera - (first frame stamp)) * (1 + skew) + lag
struct ClockRate {
  double skew = 0.0;     // s per s; within kLargestSkew
  double sigma = 0.0;    // of the line through the stretches' delays, by their scatter
  double drift_s = 0.0;  // skew times the time that the stretches cover
  int stretches = 0;     // on the line
  // The delay drifts so far that a search for one delay is blurred, and along a line: no step and
  // no wandering.
  bool beyond_doubt = false;
};

// Real clocks differ by up to 300 ppm; a logger that takes a nominal rate for the true one, by some
// percent.
constexpr double kLargestSkew = 0.022;

// The camera is cut into stretches within which even the largest skew moves the delay by less than
// the motion takes to change. Where all stretches together fit best, over delays and skews, is
// refined by the delay that each has of its own, and a robust line through these. Stretches at rest
// say nothing, and are left out. Lags are searched from first_lag_s to last_lag_s for the first
// frame.
ClockRate FindClockRate(const GyroRates& gyro, const CameraRates& camera, double first_lag_s,
                        double last_lag_s);

// The camera as a clock with the gyro's rate has it.
CameraRates OnGyroClock(CameraRates camera, double skew);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_CLOCK_RATE_H_
