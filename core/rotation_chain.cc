#include "core/rotation_chain.h"

#include <algorithm>
#include <numeric>

#include "core/so3.h"

namespace camgyro {

RotationChain::RotationChain(const std::vector<double>& times_s,
                             const Eigen::Matrix3Xd& omega_gyro_rad_s,
                             const std::vector<int>& value_of)
    : times_s_(times_s), omega_(omega_gyro_rad_s), value_of_(value_of) {
  const size_t n = times_s_.size();
  if (value_of_.empty()) {
    value_of_.resize(n);
    std::iota(value_of_.begin(), value_of_.end(), 0);
  }
  prefix_.resize(n);
  until_.resize(3 * static_cast<Eigen::Index>(n), 3);
  whole_.resize(3 * static_cast<Eigen::Index>(num_values()), 3);
  prefix_[0].setIdentity();
  // By the rate of sample j, through the segment before it; by its value, through all before that.
  Eigen::Matrix3d before = Eigen::Matrix3d::Zero(), earlier = Eigen::Matrix3d::Zero();
  for (size_t j = 0; j < n; ++j) {
    const auto col = static_cast<Eigen::Index>(j);
    if (j > 0 && value_of_[j] != value_of_[j - 1]) earlier.setZero();
    until_.middleRows<3>(3 * col) = earlier + before;
    earlier += before;
    if (j + 1 < n) {
      const double dt = times_s_[j + 1] - times_s_[j];
      const Eigen::Vector3d theta = 0.5 * dt * (omega_.col(col) + omega_.col(col + 1));
      const TurnAndJacobian turn = TurnAndLeftJacobian(theta);
      prefix_[j + 1] = prefix_[j] * turn.R;
      before = 0.5 * dt * (prefix_[j] * turn.J_left).transpose();
      earlier += before;
    }
    whole_.middleRows<3>(3 * value_of_[j]) = earlier;
  }
}

void RotationChain::At(double time_s, State* state) const {
  const int last = size() - 1;
  const auto upper = std::upper_bound(times_s_.begin(), times_s_.end(), time_s);
  int j = static_cast<int>(upper - times_s_.begin()) - 1;
  Eigen::Vector3d theta;
  if (j < 0 || j >= last) {  // held rate outside the samples
    const int held = j < 0 ? 0 : last;
    state->segment = j < 0 ? 0 : last - 1;
    state->weight_next = j < 0 ? 0.0 : 1.0;
    state->alpha_gyro_rad_s2.setZero();
    const double duration = time_s - times_s_[static_cast<size_t>(held)];
    state->theta_this_s = j < 0 ? duration : 0.0;
    state->theta_next_s = j < 0 ? 0.0 : duration;
    state->omega_gyro_rad_s = omega_.col(held);
    theta = duration * state->omega_gyro_rad_s;
    j = held;
  } else {
    const double t0 = times_s_[static_cast<size_t>(j)];
    const double dt = times_s_[static_cast<size_t>(j) + 1] - t0;
    const double elapsed = time_s - t0;
    state->segment = j;
    state->weight_next = elapsed / dt;
    state->theta_next_s = 0.5 * elapsed * state->weight_next;
    state->theta_this_s = elapsed - state->theta_next_s;
    state->alpha_gyro_rad_s2 = (omega_.col(j + 1) - omega_.col(j)) / dt;
    state->omega_gyro_rad_s = omega_.col(j) + elapsed * state->alpha_gyro_rad_s2;
    theta = state->theta_this_s * omega_.col(j) + state->theta_next_s * omega_.col(j + 1);
  }
  const Eigen::Matrix3d& start = prefix_[static_cast<size_t>(j)];
  const TurnAndJacobian turn = TurnAndLeftJacobian(theta);
  state->J_phi_theta.noalias() = start * turn.J_left;
  state->R_ref_gyro.noalias() = start * turn.R;
}

void RotationChain::AddRateGradient(const State& state, const Eigen::Vector3d& by_phi,
                                    const Eigen::Vector3d& by_omega, RateGradient gradient) const {
  const int m = state.segment;
  // Whole segments before the one of `state`; past the last sample, the last one is whole too.
  const int whole = (state.weight_next == 1.0 && state.theta_this_s == 0.0) ? m + 1 : m;
  const int value = value_of_[static_cast<size_t>(whole)];
  Eigen::Map<Eigen::VectorXd>(gradient.data(), 3 * value) +=
      whole_.topRows(3 * value).lazyProduct(by_phi);
  gradient.col(value) += until_.middleRows<3>(3 * whole) * by_phi;
  const Eigen::Vector3d by_theta = state.J_phi_theta.transpose() * by_phi;
  gradient.col(value_of_[static_cast<size_t>(m)]) +=
      state.theta_this_s * by_theta + (1.0 - state.weight_next) * by_omega;
  gradient.col(value_of_[static_cast<size_t>(m) + 1]) +=
      state.theta_next_s * by_theta + state.weight_next * by_omega;
}

}  // namespace camgyro
