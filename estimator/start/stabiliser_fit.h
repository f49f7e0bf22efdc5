// Fit of the camera's rates to the gyro's, through a lens that follows the camera's turns.
#ifndef CAMGYRO_ESTIMATOR_START_STABILISER_FIT_H_
#define CAMGYRO_ESTIMATOR_START_STABILISER_FIT_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/optical_stabiliser.h"
#include "estimator/start/rate_alignment.h"

namespace camgyro {

// A fit of the camera's rates to the gyro's, through a lens that follows the camera's turns. The
// rates that pictures show about the camera's x and y axes are scale * (omega - gain * angle'),
// with the stabilised angle of core/optical_stabiliser.h; that about its z axis is omega's.
struct StabiliserFit {
  // Order of the covariance: lag [s], rotation (right perturbation of q_gyro_cam, camera's axes)
  // [rad], bias [rad/s], log of the scale, gain, log of the corner, log of the travel.
  static constexpr int kSize = 11;
  static constexpr int kLag = 0, kRotation = 1, kBias = 4, kLogScale = 7, kGain = 8;
  using Covariance = Eigen::Matrix<double, kSize, kSize>;

  OpticalStabiliser stabiliser;  // a lens that reaches no stop has none
  double gain = 0.0;             // of the lens: 0: it is held; 1: nothing of the angle is left
  double scale = 1.0;            // true focal length / that of the rotations
  double lag_s = 0.0;            // as RateAlignment's
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  double noise_rad_s = 0.0;       // what the fit leaves, per axis and pair, robust
  double held_noise_rad_s = 0.0;  // the same of a fit with the lens held
  double explained = 0.0;         // of the gyro's power about its mean, outliers down-weighted
  Covariance covariance = Covariance::Zero();
  bool converged = false;
};

// Corner, stop and lag by a grid around a start, then all by robust least squares. A camera that
// does not turn enough to tell has wide sigmas: weak priors hold what no motion shows.
StabiliserFit FitStabiliser(const RateAlignment& alignment, double lag_s,
                            const Eigen::Quaterniond& q_gyro_cam,
                            const Eigen::Vector3d& bias_gyro_rad_s);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_STABILISER_FIT_H_
