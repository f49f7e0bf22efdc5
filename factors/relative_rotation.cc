#include "factors/relative_rotation.h"

#include <glog/logging.h>

#include <utility>

#include "core/pair_model.h"
#include "core/so3.h"
#include "factors/robust.h"
#include "factors/rotation_manifold.h"

namespace camgyro {

namespace {

// By each rate group; J_phi_a: by the left perturbation of the chain at a, minus that by b.
void WriteRateJacobians(const PairMeasurement& m, const RotationChain& chain,
                        const RotationChain::State& a, const RotationChain::State& b,
                        const Eigen::Matrix3d& J_phi_a, double** jacobians) {
  Eigen::Matrix3Xd by_rates(3, chain.size());
  for (int i = 0; i < 3; ++i) {
    by_rates.setZero();
    const Eigen::Vector3d by_phi = J_phi_a.row(i);
    chain.AddRateGradient(a, by_phi, Eigen::Vector3d::Zero(), by_rates);
    chain.AddRateGradient(b, -by_phi, Eigen::Vector3d::Zero(), by_rates);
    int column = 0;
    for (size_t g = 0; g < m.rate_group_sizes.size(); ++g) {
      const int size = m.rate_group_sizes[g];
      if (double* J = jacobians[g]) {
        Eigen::Map<Eigen::Matrix3Xd>(J + 3 * size * i, 3, size) = by_rates.middleCols(column, size);
      }
      column += size;
    }
  }
}

}  // namespace

RelativeRotation::RelativeRotation(std::shared_ptr<const PairMeasurement> pair)
    : pair_(std::move(pair)) {
  const PairMeasurement& m = *pair_;
  CHECK_GT(m.sigma, 0.0);
  CHECK_GE(m.rate_times_s.size(), 2u);
  CHECK(m.matches.empty());
  CHECK_EQ(m.rate_step, 1);
  set_num_residuals(3);
  *mutable_parameter_block_sizes() = {kShutterSize, 4};
  if (m.effects) mutable_parameter_block_sizes()->push_back(m.effects->size());
  mutable_parameter_block_sizes()->resize(
      parameter_block_sizes().size() + static_cast<size_t>(NumTimeBlocks(m)), 1);
  for (const int size : m.rate_group_sizes) mutable_parameter_block_sizes()->push_back(3 * size);
}

bool RelativeRotation::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const PairMeasurement& m = *pair_;
  const int times_block = kEffectsBlock + NumEffectBlocks(m);
  const int first_rate_group = times_block + NumTimeBlocks(m);
  const RotationChain chain(m.rate_times_s,
                            GatherRates(m.rate_group_sizes, parameters + first_rate_group));
  double time_a_s = m.frame_a.stamp_s + m.frame_a.offset_s;
  double time_b_s = m.frame_b.stamp_s + m.frame_b.offset_s;
  for (double* time : {&time_a_s, &time_b_s}) {
    *time += parameters[0][kDelay] + m.row_fraction * parameters[0][kReadout];
  }
  if (m.own_times) {
    time_a_s += *parameters[times_block];
    time_b_s += *parameters[times_block + 1];
  }
  EffectSet::Change change_a, change_b;
  if (m.effects) {
    // An attitude has no pixel: it is that of the row, in a picture of unit size.
    const Eigen::Vector2d px(0.5, m.row_fraction), size(1.0, 1.0);
    m.effects->ChangeObservation({px, size, m.frame_a}, &change_a);
    m.effects->ChangeObservation({px, size, m.frame_b}, &change_b);
    const Eigen::Map<const Eigen::VectorXd> values(parameters[kEffectsBlock], m.effects->size());
    time_a_s += change_a.time.row(0) * values;
    time_b_s += change_b.time.row(0) * values;
  }
  const RotationChain::State a = chain.At(time_a_s);
  const RotationChain::State b = chain.At(time_b_s);
  const Eigen::Matrix3d R_gyro_cam =
      Eigen::Map<const Eigen::Quaterniond>(parameters[1]).normalized().toRotationMatrix();
  const Eigen::Matrix3d R_a_b = m.q_a_b.toRotationMatrix();
  const Eigen::Matrix3d error =
      b.R_ref_gyro.transpose() * a.R_ref_gyro * R_gyro_cam * R_a_b * R_gyro_cam.transpose();
  const Eigen::Vector3d log_error = Log(Eigen::Quaterniond(error));
  Eigen::Matrix3d robust = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const RobustResidual r = Robustify(log_error[i] / m.sigma, m.robust_threshold);
    residuals[i] = r.value;
    robust(i, i) = r.derivative / m.sigma;
  }
  if (jacobians == nullptr) return true;

  // phi: left perturbations of the chain at a and b. They move `error` on the left by
  // R_b^T (phi_a - phi_b); a right perturbation of R_gyro_cam moves it on the right.
  const Eigen::Matrix3d J_phi_a =
      robust * LeftJacobianInverse(log_error) * b.R_ref_gyro.transpose();
  if (jacobians[0] != nullptr) {
    const Eigen::Vector3d by_shift = J_phi_a * (a.PhiPerSecond() - b.PhiPerSecond());
    Eigen::Map<Eigen::Matrix<double, 3, kShutterSize, Eigen::RowMajor>> J(jacobians[0]);
    J.col(kDelay) = by_shift;
    J.col(kReadout) = m.row_fraction * by_shift;
  }
  if (m.effects && jacobians[kEffectsBlock] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>(jacobians[kEffectsBlock],
                                                                          3, m.effects->size()) =
        J_phi_a *
        (a.PhiPerSecond() * change_a.time.row(0) - b.PhiPerSecond() * change_b.time.row(0));
  }
  for (int k = 0; m.own_times && k < 2; ++k) {
    double* jacobian = jacobians[times_block + k];
    if (jacobian == nullptr) continue;
    Eigen::Map<Eigen::Vector3d>(jacobian, 3) =
        J_phi_a * (k == 0 ? a.PhiPerSecond() : Eigen::Vector3d(-b.PhiPerSecond()));
  }
  if (jacobians[1] != nullptr) {
    const Eigen::Matrix3d J_rotation = robust * RightJacobianInverse(log_error) * R_gyro_cam *
                                       (R_a_b.transpose() - Eigen::Matrix3d::Identity());
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> J(jacobians[1]);
    for (int i = 0; i < 3; ++i) J.row(i) = RotationManifold::Lift(J_rotation.row(i), parameters[1]);
  }
  WriteRateJacobians(m, chain, a, b, J_phi_a, jacobians + first_rate_group);
  return true;
}

}  // namespace camgyro
