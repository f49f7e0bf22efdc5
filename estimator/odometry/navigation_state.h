// Pose, velocity and biases of the gyro (IMU) frame, and how inertial data carry them on.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_NAVIGATION_STATE_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_NAVIGATION_STATE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/imu_integral.h"

namespace camgyro {

// World frame: z up, at rest. Biases are added to what the sensors report.
struct NavigationState {
  Eigen::Quaterniond q_world_gyro = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_world_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_accel_m_s2 = Eigen::Vector3d::Zero();
};

// Rows of a covariance of the state: right perturbation of q_world_gyro [rad], position, velocity,
// gyro bias, accelerometer bias.
enum NavigationIndex : int {
  kNavRotation = 0,
  kNavPosition = 3,
  kNavVelocity = 6,
  kNavBiasGyro = 9,
  kNavBiasAccel = 12,
  kNavSize = 15
};
using NavigationCovariance = Eigen::Matrix<double, kNavSize, kNavSize>;

// Random walks of the biases, continuous densities of one axis.
struct BiasWalkDensity {
  double gyro_rad_s2_rtHz = 2e-5;
  double accel_m_s3_rtHz = 3e-3;
};

// The state a delta later; the delta was made with the state's biases.
NavigationState Predict(const NavigationState& state, const ImuDelta& delta, double gravity_m_s2);

// Its covariance. `noise`: that of the delta (ImuIntegral::Covariance); the biases walk.
NavigationCovariance PredictCovariance(const NavigationState& state,
                                       const NavigationCovariance& covariance,
                                       const ImuDelta& delta,
                                       const Eigen::Matrix<double, 9, 9>& noise,
                                       const BiasWalkDensity& walk);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_NAVIGATION_STATE_H_
