// A gyro's clock that was found behind stamps of arrival, and what the stamps leave open of it: how
// far it is off them, and at what rate it runs. Recordings whose gyro has its stamps as recorded
// are left alone.
#ifndef CAMGYRO_ESTIMATOR_GYRO_CLOCK_H_
#define CAMGYRO_ESTIMATOR_GYRO_CLOCK_H_

#include <string>

#include "core/calibration.h"
#include "core/recording.h"

namespace camgyro {

// The shape of the effect clock_skew that lets a fit find the clock's rate; empty where the stamps
// tell it so well that the rest does not show, or the gyro's clock is none that was found.
std::string ShapeOfGyroClock(const Recording& recording);

// Adds to the covariance of a fit what it cannot find: the clock's offset is a part of the delay;
// by its rate the angles between samples are wrong, and with them the focal length. (The rate that
// a fit finds is that of two clocks: which of them is right, it does not say.)
void AddGyroClock(const Recording& recording, Calibration* calibration);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_GYRO_CLOCK_H_
