#include "estimator/odometry/navigation_state.h"

#include "core/so3.h"

namespace camgyro {

using Eigen::Matrix3d;
using Eigen::Vector3d;

NavigationState Predict(const NavigationState& state, const ImuDelta& delta, double gravity_m_s2) {
  const Vector3d gravity(0.0, 0.0, -gravity_m_s2);
  const double dt = delta.dt_s;
  NavigationState next = state;
  next.q_world_gyro = (state.q_world_gyro * delta.q_i_j).normalized();
  next.p_world_m +=
      state.v_world_m_s * dt + 0.5 * dt * dt * gravity + state.q_world_gyro * delta.dp;
  next.v_world_m_s += gravity * dt + state.q_world_gyro * delta.dv;
  return next;
}

NavigationCovariance PredictCovariance(const NavigationState& state,
                                       const NavigationCovariance& covariance,
                                       const ImuDelta& delta,
                                       const Eigen::Matrix<double, 9, 9>& noise,
                                       const BiasWalkDensity& walk) {
  const Matrix3d R = state.q_world_gyro.toRotationMatrix();
  NavigationCovariance F = NavigationCovariance::Identity();
  F.block<3, 3>(kNavRotation, kNavRotation) = delta.q_i_j.toRotationMatrix().transpose();
  F.block<3, 3>(kNavRotation, kNavBiasGyro) = delta.J_rot_bias_gyro;
  F.block<3, 3>(kNavPosition, kNavRotation) = -R * Hat(delta.dp);
  F.block<3, 3>(kNavPosition, kNavVelocity) = delta.dt_s * Matrix3d::Identity();
  F.block<3, 3>(kNavPosition, kNavBiasGyro) = R * delta.J_dp_bias_gyro;
  F.block<3, 3>(kNavPosition, kNavBiasAccel) = R * delta.J_dp_bias_accel;
  F.block<3, 3>(kNavVelocity, kNavRotation) = -R * Hat(delta.dv);
  F.block<3, 3>(kNavVelocity, kNavBiasGyro) = R * delta.J_dv_bias_gyro;
  F.block<3, 3>(kNavVelocity, kNavBiasAccel) = R * delta.J_dv_bias_accel;
  // The delta's noise: rotation, dv, dp.
  Eigen::Matrix<double, kNavSize, 9> G = Eigen::Matrix<double, kNavSize, 9>::Zero();
  G.block<3, 3>(kNavRotation, 0).setIdentity();
  G.block<3, 3>(kNavVelocity, 3) = R;
  G.block<3, 3>(kNavPosition, 6) = R;
  NavigationCovariance next = F * covariance * F.transpose() + G * noise * G.transpose();
  next.diagonal().segment<3>(kNavBiasGyro).array() +=
      walk.gyro_rad_s2_rtHz * walk.gyro_rad_s2_rtHz * delta.dt_s;
  next.diagonal().segment<3>(kNavBiasAccel).array() +=
      walk.accel_m_s3_rtHz * walk.accel_m_s3_rtHz * delta.dt_s;
  return next;
}

}  // namespace camgyro
