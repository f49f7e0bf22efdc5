// Robust least squares of lag, orientation and bias together, with their covariance.
#ifndef CAMGYRO_ESTIMATOR_START_START_FIT_H_
#define CAMGYRO_ESTIMATOR_START_START_FIT_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "estimator/start/rate_alignment.h"

namespace camgyro {

struct StartFit {
  // Order of the covariance: lag [s], rotation (right perturbation of q_gyro_cam, camera's axes)
  // [rad], bias [rad/s].
  static constexpr int kSize = 7;
  using Covariance = Eigen::Matrix<double, kSize, kSize>;

  double lag_s = 0.0;
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::VectorXd robust_weight;  // 0..1 per pair, 0 outside the gyro's time
  double inliers = 0.0;           // fraction with residuals that normal noise explains (99 %)
  double noise_rad_s = 0.0;       // residual rate per axis and pair, robust
  Covariance covariance = Covariance::Zero();
  bool converged = false;
};

// Minimises sum_i w_i rho(| g_i(lag, b) - R_gyro_cam c_i - b |) over lag, R, b, where g_i is the
// gyro's rotation over the shifted interval (ordered product, bias removed inside, so exact where
// the closed form of RateAlignment is first order) as a mean rate. Gauss-Newton, Cauchy weights,
// scale from the median residual.
//
// The covariance is the larger, parameter by parameter, of the classical one and of one that
// allows residuals to be correlated within blocks of time (sandwich): a delay that steps makes
// such residuals. A direction of the rotation that no motion excites gets sigma 1 rad.
StartFit FitStart(const RateAlignment& alignment, double lag_s,
                  const Eigen::Quaterniond& q_gyro_cam, const Eigen::Vector3d& bias_gyro_rad_s);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_START_FIT_H_
