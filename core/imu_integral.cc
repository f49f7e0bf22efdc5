#include "core/imu_integral.h"

#include <algorithm>
#include <cmath>

#include "core/so3.h"
#include "core/time.h"

namespace camgyro {

using Eigen::Matrix3d;
using Eigen::Vector3d;

ImuIntegral::ImuIntegral(const std::vector<GyroSample>& gyro, const std::vector<AccelSample>& accel,
                         int64_t origin_ns, const Vector3d& bias_gyro_rad_s,
                         const Vector3d& bias_accel_m_s2)
    : omega_(3, static_cast<Eigen::Index>(gyro.size())),
      force_(Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(gyro.size()))) {
  times_s_.reserve(gyro.size());
  size_t next = 0;  // first accelerometer sample after the gyro's
  for (size_t i = 0; i < gyro.size(); ++i) {
    times_s_.push_back(SecondsSince(origin_ns, gyro[i].stamp_ns));
    omega_.col(i) = gyro[i].omega_gyro_rad_s - bias_gyro_rad_s;
    if (accel.empty()) continue;
    while (next < accel.size() && accel[next].stamp_ns <= gyro[i].stamp_ns) ++next;
    const AccelSample& after = accel[std::min(next, accel.size() - 1)];
    const AccelSample& before = accel[next == 0 ? 0 : next - 1];
    const double span_s = SecondsSince(before.stamp_ns, after.stamp_ns);
    const double weight =
        span_s > 0.0
            ? std::clamp(SecondsSince(before.stamp_ns, gyro[i].stamp_ns) / span_s, 0.0, 1.0)
            : 0.0;
    force_.col(i) =
        (1.0 - weight) * before.accel_gyro_m_s2 + weight * after.accel_gyro_m_s2 - bias_accel_m_s2;
  }
  states_.emplace_back();
  for (size_t i = 0; i + 1 < times_s_.size(); ++i) {
    states_.push_back(Step(states_[i], times_s_[i + 1] - times_s_[i], omega_.col(i),
                           omega_.col(i + 1), force_.col(i), force_.col(i + 1)));
  }
}

ImuIntegral::State ImuIntegral::Step(const State& from, double dt, const Vector3d& omega_from,
                                     const Vector3d& omega_to, const Vector3d& force_from,
                                     const Vector3d& force_to) const {
  State to;
  const Vector3d theta = 0.5 * dt * (omega_from + omega_to);
  const Matrix3d turn = Exp(theta).toRotationMatrix();
  to.R = from.R * turn;
  to.J_rot = turn.transpose() * from.J_rot - dt * RightJacobian(theta);
  // The force is linear in the frame of reference; so are its derivatives.
  const Vector3d a0 = from.R * force_from, a1 = to.R * force_to;
  const Matrix3d bg0 = -from.R * Hat(force_from) * from.J_rot;
  const Matrix3d bg1 = -to.R * Hat(force_to) * to.J_rot;
  const double half = 0.5 * dt, third = dt * dt / 3.0, sixth = dt * dt / 6.0;
  to.v = from.v + half * (a0 + a1);
  to.p = from.p + dt * from.v + third * a0 + sixth * a1;
  to.J_v_bg = from.J_v_bg + half * (bg0 + bg1);
  to.J_p_bg = from.J_p_bg + dt * from.J_v_bg + third * bg0 + sixth * bg1;
  to.J_v_ba = from.J_v_ba - half * (from.R + to.R);
  to.J_p_ba = from.J_p_ba + dt * from.J_v_ba - third * from.R - sixth * to.R;
  return to;
}

size_t ImuIntegral::Segment(double time_s, double* weight_next) const {
  const auto after = std::upper_bound(times_s_.begin() + 1, times_s_.end() - 1, time_s);
  const auto segment = static_cast<size_t>(after - times_s_.begin()) - 1;
  *weight_next = std::clamp(
      (time_s - times_s_[segment]) / (times_s_[segment + 1] - times_s_[segment]), 0.0, 1.0);
  return segment;
}

ImuIntegral::State ImuIntegral::At(double time_s) const {
  double weight = 0.0;
  const size_t i = Segment(time_s, &weight);
  return Step(states_[i], time_s - times_s_[i], omega_.col(i), RateAt(time_s), force_.col(i),
              ForceAt(time_s));
}

ImuDelta ImuIntegral::Between(double from_s, double to_s) const {
  const State a = At(from_s), b = At(to_s);
  const Matrix3d R_a_ref = a.R.transpose();
  ImuDelta delta;
  delta.dt_s = to_s - from_s;
  const Matrix3d R_a_b = R_a_ref * b.R;
  delta.q_i_j = Eigen::Quaterniond(R_a_b).normalized();
  delta.dv = R_a_ref * (b.v - a.v);
  delta.dp = R_a_ref * (b.p - a.p - a.v * delta.dt_s);
  // The frame at `from` turns with the bias too: Exp(J d)' x = x + x x (J d).
  delta.J_rot_bias_gyro = b.J_rot - R_a_b.transpose() * a.J_rot;
  delta.J_dv_bias_gyro = R_a_ref * (b.J_v_bg - a.J_v_bg) + Hat(delta.dv) * a.J_rot;
  delta.J_dp_bias_gyro =
      R_a_ref * (b.J_p_bg - a.J_p_bg - a.J_v_bg * delta.dt_s) + Hat(delta.dp) * a.J_rot;
  delta.J_dv_bias_accel = R_a_ref * (b.J_v_ba - a.J_v_ba);
  delta.J_dp_bias_accel = R_a_ref * (b.J_p_ba - a.J_p_ba - a.J_v_ba * delta.dt_s);
  return delta;
}

ImuIntegral::Matrix9d ImuIntegral::Covariance(double from_s, double to_s,
                                              const ImuNoise& noise) const {
  Matrix9d covariance = Matrix9d::Zero();
  double weight = 0.0;
  double time_s = from_s;
  const Eigen::Quaterniond q_from = RotationAt(from_s);
  for (size_t i = Segment(from_s, &weight); time_s < to_s; ++i) {
    const double next_s = i + 1 < times_s_.size() ? std::min(times_s_[i + 1], to_s) : to_s;
    const double dt = next_s - time_s;
    if (dt <= 0.0) continue;
    const double middle_s = 0.5 * (time_s + next_s);
    const Matrix3d R = (q_from.conjugate() * RotationAt(middle_s)).toRotationMatrix();
    const Matrix3d turn = Exp(Vector3d(RateAt(middle_s) * dt)).toRotationMatrix();
    Matrix9d F = Matrix9d::Identity();
    F.block<3, 3>(0, 0) = turn.transpose();
    F.block<3, 3>(3, 0) = -R * Hat(ForceAt(middle_s)) * dt;
    F.block<3, 3>(6, 0) = 0.5 * dt * F.block<3, 3>(3, 0);
    F.block<3, 3>(6, 3) = Matrix3d::Identity() * dt;
    covariance = F * covariance * F.transpose();
    const double gyro = noise.gyro_rad_s_rtHz * noise.gyro_rad_s_rtHz;
    const double accel = noise.accel_m_s2_rtHz * noise.accel_m_s2_rtHz;
    covariance.block<3, 3>(0, 0).diagonal().array() += gyro * dt;
    covariance.block<3, 3>(3, 3).diagonal().array() += accel * dt;
    covariance.block<3, 3>(3, 6).diagonal().array() += accel * dt * dt / 2.0;
    covariance.block<3, 3>(6, 3).diagonal().array() += accel * dt * dt / 2.0;
    covariance.block<3, 3>(6, 6).diagonal().array() += accel * dt * dt * dt / 3.0;
    time_s = next_s;
  }
  return covariance;
}

Eigen::Quaterniond ImuIntegral::RotationAt(double time_s) const {
  double weight = 0.0;
  const size_t i = Segment(time_s, &weight);
  const Vector3d omega = 0.5 * (omega_.col(i) + RateAt(time_s));
  return (Eigen::Quaterniond(states_[i].R) * Exp(Vector3d(omega * (time_s - times_s_[i]))))
      .normalized();
}

Vector3d ImuIntegral::RateAt(double time_s) const {
  double weight = 0.0;
  const size_t i = Segment(time_s, &weight);
  return (1.0 - weight) * omega_.col(i) + weight * omega_.col(i + 1);
}

Vector3d ImuIntegral::ForceAt(double time_s) const {
  double weight = 0.0;
  const size_t i = Segment(time_s, &weight);
  return (1.0 - weight) * force_.col(i) + weight * force_.col(i + 1);
}

}  // namespace camgyro
