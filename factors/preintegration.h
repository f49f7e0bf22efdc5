// Two poses and velocities of the gyro frame against the inertial measurements between them.
#ifndef CAMGYRO_FACTORS_PREINTEGRATION_H_
#define CAMGYRO_FACTORS_PREINTEGRATION_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>

#include "core/imu_integral.h"

namespace camgyro {

//   r = sqrt_information * [ Log( (q_i_j Exp(J db_g))^-1 q_i^-1 q_j )
//                            R_i' (v_j - v_i - g dt) - dv(b)
//                            R_i' (p_j - p_i - v_i dt - g dt^2 / 2) - dp(b) ]
//   dv(b) = dv + J_dv_bg db_g + J_dv_ba b_a, dp likewise
//
// Parameters  q_w_gyro_i 4, p_w_i 3 [m], v_w_i 3 [m/s], the same three of j
//             gravity_w 3           unit vector; times gravity_m_s2
//             bias_accel 3          [m/s^2], gyro frame; the delta was made with zero
//             calibration 11        deviation from the calibration that the delta was made with, in
//                                   the order of StateIndex; only the bias is used
// Residual    9, in sigmas
// Valid       while the biases move little enough for first order: db_g dt < 0.05 rad
// Source      Forster, Carlone, Dellaert, Scaramuzza, RSS 2015
struct PreintegrationMeasurement {
  ImuDelta delta;
  Eigen::Matrix<double, 9, 9> covariance;  // ImuIntegral::Covariance; positive definite
  double gravity_m_s2 = 9.80665;
};
std::unique_ptr<ceres::CostFunction> MakePreintegration(const PreintegrationMeasurement& m);

// The same with both biases as parameters of state i, for windows in which they walk: in the place
// of bias_accel and calibration it takes
//             bias_gyro 3 [rad/s], bias_accel 3 [m/s^2]    gyro frame
struct BiasedPreintegrationMeasurement {
  PreintegrationMeasurement preintegration;
  // What was taken out when the delta was made.
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_accel_m_s2 = Eigen::Vector3d::Zero();
};
std::unique_ptr<ceres::CostFunction> MakePreintegrationWithBias(
    const BiasedPreintegrationMeasurement& m);

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_PREINTEGRATION_H_
