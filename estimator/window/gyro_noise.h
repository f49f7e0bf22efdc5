// How noisy the samples of a gyro are.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_GYRO_NOISE_H_
#define CAMGYRO_ESTIMATOR_WINDOW_GYRO_NOISE_H_

#include <Eigen/Core>

#include "core/recording.h"

namespace camgyro {

// What the samples show while the camera ran, of one sample per axis [rad/s], at least 5e-4, for
// samples that are rounded: third differences, which hold little of a motion, as if they were of
// white noise (robust scale). Vibration turns a device to and fro, and by less than white noise of
// such samples would: means over 2, 4, ... samples, as long as those that are estimated
// (PairGraphOptions::rate_step_s), have less of it, and more of the motion. The least of them
// counts: what there is of noise is no more.
Eigen::Vector3d ShownGyroSigma(const Recording& recording, double delay_s);

// White noise of one gyro sample per axis [rad/s]: as declared, else what the samples show.
Eigen::Vector3d GyroSigma(const Recording& recording, double delay_s);

// Variance of the turn about one axis that such noise adds up to in a second, mean of the axes
// [rad^2 / s]. interval_s: of the samples.
double TurnVariancePerS(const Eigen::Vector3d& sigma_rad_s, double interval_s);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_GYRO_NOISE_H_
