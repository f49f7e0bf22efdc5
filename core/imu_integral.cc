#include "core/imu_integral.h"

#include <algorithm>
#include <cmath>

#include "core/so3.h"
#include "core/time.h"

namespace camgyro {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

// Steps that differ by more are no place for a second difference: a sample lost, or stamped late.
constexpr double kMostUnevenSteps = 2.0;

// Second derivatives between samples i and i + 1: the mean of those at both; at an end, or beside
// uneven steps, the one that there is, or zero.
MatrixXd Bends(const std::vector<double>& times_s, const MatrixXd& values) {
  const Eigen::Index n = values.cols();
  MatrixXd sums = MatrixXd::Zero(values.rows(), n - 1);
  Eigen::ArrayXd counts = Eigen::ArrayXd::Zero(n - 1);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const auto at = static_cast<size_t>(i);
    const double before_s = times_s[at] - times_s[at - 1], after_s = times_s[at + 1] - times_s[at];
    if (!(after_s < kMostUnevenSteps * before_s && before_s < kMostUnevenSteps * after_s)) continue;
    const Eigen::VectorXd bend = 2.0 / (before_s + after_s) *
                                 ((values.col(i + 1) - values.col(i)) / after_s -
                                  (values.col(i) - values.col(i - 1)) / before_s);
    for (const Eigen::Index segment : {i - 1, i}) {
      sums.col(segment) += bend;
      counts[segment] += 1.0;
    }
  }
  return sums * counts.max(1.0).inverse().matrix().asDiagonal();
}

// Where a parabola of unit bend is against its chord, which spans span_s, dt_s after its beginning.
double AboveChord(double dt_s, double span_s) {
  return 0.5 * std::clamp(dt_s, 0.0, span_s) * std::min(dt_s - span_s, 0.0);
}

}  // namespace

ImuIntegral::ImuIntegral(const std::vector<GyroSample>& gyro, const std::vector<AccelSample>& accel,
                         int64_t origin_ns, const Vector3d& bias_gyro_rad_s,
                         const Vector3d& bias_accel_m_s2)
    : omega_(3, static_cast<Eigen::Index>(gyro.size())),
      force_(Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(gyro.size()))),
      accel_(21, static_cast<Eigen::Index>(gyro.size())) {
  times_s_.reserve(gyro.size());
  for (size_t i = 0; i < gyro.size(); ++i) {
    times_s_.push_back(SecondsSince(origin_ns, gyro[i].stamp_ns));
    omega_.col(i) = gyro[i].omega_gyro_rad_s - bias_gyro_rad_s;
  }
  omega_bend_ = Bends(times_s_, omega_);
  if (!accel.empty()) ResampleForce(accel, origin_ns, bias_accel_m_s2);
  states_.resize(times_s_.size());
  for (size_t i = 0; i < times_s_.size(); ++i) {
    State& state = states_[i];
    if (i > 0) Turn(states_[i - 1], i - 1, times_s_[i] - times_s_[i - 1], &state);
    WithDerivatives force;
    force << state.R * force_.col(i), -state.R * Hat(Vector3d(force_.col(i))) * state.J_rot,
        -state.R;
    accel_.col(i) = force.reshaped();
  }
  accel_bend_ = Bends(times_s_, accel_);
  for (size_t i = 0; i + 1 < times_s_.size(); ++i) {
    Travel(states_[i], i, times_s_[i + 1] - times_s_[i], &states_[i + 1]);
  }
}

// The accelerometer's samples, less its bias, at the gyro's times.
void ImuIntegral::ResampleForce(const std::vector<AccelSample>& accel, int64_t origin_ns,
                                const Vector3d& bias_accel_m_s2) {
  std::vector<double> times_s;
  Eigen::Matrix3Xd force(3, static_cast<Eigen::Index>(accel.size()));
  for (size_t i = 0; i < accel.size(); ++i) {
    times_s.push_back(SecondsSince(origin_ns, accel[i].stamp_ns));
    force.col(i) = accel[i].accel_gyro_m_s2 - bias_accel_m_s2;
  }
  const MatrixXd bends = Bends(times_s, force);
  size_t next = 0;  // first accelerometer sample after the gyro's
  for (size_t i = 0; i < times_s_.size(); ++i) {
    while (next < times_s.size() && times_s[next] <= times_s_[i]) ++next;
    if (next == 0 || next == times_s.size()) {
      force_.col(i) = force.col(next == 0 ? 0 : next - 1);
      continue;
    }
    const size_t before = next - 1;
    const double span_s = times_s[next] - times_s[before], dt_s = times_s_[i] - times_s[before];
    force_.col(i) = force.col(before) + dt_s / span_s * (force.col(next) - force.col(before)) +
                    AboveChord(dt_s, span_s) * bends.col(before);
  }
}

void ImuIntegral::Turn(const State& from, size_t i, double dt_s, State* to) const {
  const Vector3d omega_from = omega_.col(i), omega_to = RateAt(times_s_[i] + dt_s);
  const bool inside = dt_s >= 0.0 && dt_s <= times_s_[i + 1] - times_s_[i];
  Vector3d theta = 0.5 * dt_s * (omega_from + omega_to);
  if (inside) {
    // The parabola's integral, and the second term of Magnus' series.
    theta += dt_s * dt_s / 12.0 * (omega_from.cross(omega_to) - dt_s * omega_bend_.col(i));
  }
  const Matrix3d turn = Exp(theta).toRotationMatrix();
  to->R = from.R * turn;
  to->J_rot = turn.transpose() * from.J_rot - dt_s * RightJacobian(theta);
}

void ImuIntegral::Travel(const State& from, size_t i, double dt_s, State* to) const {
  const double span_s = times_s_[i + 1] - times_s_[i];
  const auto row = static_cast<Eigen::Index>(i);
  WithDerivatives bend = accel_bend_.col(row).reshaped(3, 7);
  if (dt_s < 0.0 || dt_s > span_s) bend.setZero();
  const double weight = std::clamp(dt_s / span_s, 0.0, 1.0);
  const WithDerivatives a0 = accel_.col(row).reshaped(3, 7);
  const WithDerivatives a1 = (1.0 - weight) * a0 + weight * accel_.col(row + 1).reshaped(3, 7) +
                             AboveChord(dt_s, span_s) * bend;
  to->v = from.v + 0.5 * dt_s * (a0 + a1) - std::pow(dt_s, 3) / 12.0 * bend;
  to->p = from.p + dt_s * from.v + dt_s * dt_s / 6.0 * (2.0 * a0 + a1) -
          std::pow(dt_s, 4) / 24.0 * bend;
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
  State state;
  Turn(states_[i], i, time_s - times_s_[i], &state);
  Travel(states_[i], i, time_s - times_s_[i], &state);
  return state;
}

ImuDelta ImuIntegral::Between(double from_s, double to_s) const {
  const State a = At(from_s), b = At(to_s);
  const Matrix3d R_a_ref = a.R.transpose();
  ImuDelta delta;
  delta.dt_s = to_s - from_s;
  const Matrix3d R_a_b = R_a_ref * b.R;
  delta.q_i_j = Eigen::Quaterniond(R_a_b).normalized();
  const WithDerivatives dv = R_a_ref * (b.v - a.v);
  const WithDerivatives dp = R_a_ref * (b.p - a.p - a.v * delta.dt_s);
  delta.dv = dv.col(0);
  delta.dp = dp.col(0);
  // The frame at `from` turns with the bias too: Exp(J d)' x = x + x x (J d).
  delta.J_rot_bias_gyro = b.J_rot - R_a_b.transpose() * a.J_rot;
  delta.J_dv_bias_gyro = dv.middleCols<3>(1) + Hat(delta.dv) * a.J_rot;
  delta.J_dp_bias_gyro = dp.middleCols<3>(1) + Hat(delta.dp) * a.J_rot;
  delta.J_dv_bias_accel = dv.rightCols<3>();
  delta.J_dp_bias_accel = dp.rightCols<3>();
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
  State state;
  Turn(states_[i], i, time_s - times_s_[i], &state);
  return Eigen::Quaterniond(state.R).normalized();
}

Vector3d ImuIntegral::RateAt(double time_s) const {
  double weight = 0.0;
  const size_t i = Segment(time_s, &weight);
  return (1.0 - weight) * omega_.col(i) + weight * omega_.col(i + 1) +
         AboveChord(time_s - times_s_[i], times_s_[i + 1] - times_s_[i]) * omega_bend_.col(i);
}

Vector3d ImuIntegral::ForceAt(double time_s) const {
  double weight = 0.0;
  const size_t i = Segment(time_s, &weight);
  return (1.0 - weight) * force_.col(i) + weight * force_.col(i + 1);
}

}  // namespace camgyro
