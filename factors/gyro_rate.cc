#include "factors/gyro_rate.h"

#include <glog/logging.h>

#include <cmath>
#include <numeric>
#include <utility>

namespace camgyro {

GyroRate::GyroRate(const Eigen::Matrix3Xd& measured_rad_s, const Eigen::Vector3d& sigma_rad_s,
                   std::shared_ptr<const EffectSet> effects, std::vector<double> times_s)
    : measured_(measured_rad_s),
      inv_sigma_(sigma_rad_s.cwiseInverse().replicate(1, measured_rad_s.cols())),
      effects_(std::move(effects)),
      times_s_(std::move(times_s)),
      samples_(static_cast<size_t>(measured_rad_s.cols()), 1) {
  CHECK_GT(sigma_rad_s.minCoeff(), 0.0);
  CHECK_GT(measured_.cols(), 0);
  const int size = static_cast<int>(measured_.size());
  set_num_residuals(size);
  *mutable_parameter_block_sizes() = {size, 3};
  if (effects_) {
    CHECK_GE(static_cast<Eigen::Index>(times_s_.size()), measured_.cols());
    mutable_parameter_block_sizes()->push_back(effects_->size());
  }
}

GyroRate::GyroRate(const Eigen::Matrix3Xd& measured_rad_s, std::vector<int> samples,
                   const Eigen::Vector3d& sigma_rad_s, std::shared_ptr<const EffectSet> effects,
                   std::vector<double> times_s, Eigen::Matrix3Xd base_rad_s)
    : GyroRate(measured_rad_s, sigma_rad_s, std::move(effects), std::move(times_s)) {
  samples_ = std::move(samples);
  base_ = std::move(base_rad_s);
  CHECK_EQ(static_cast<Eigen::Index>(samples_.size()), measured_.cols());
  for (size_t i = 0; i < samples_.size(); ++i) {
    inv_sigma_.col(static_cast<Eigen::Index>(i)) *= std::sqrt(samples_[i]);
  }
  if (effects_ == nullptr) return;
  CHECK_EQ(static_cast<Eigen::Index>(times_s_.size()), base_.cols());
  CHECK_EQ(std::accumulate(samples_.begin(), samples_.end(), Eigen::Index{0}), base_.cols());
}

Eigen::MatrixXd GyroRate::AddEffects(const Eigen::Map<const Eigen::Matrix3Xd>& rates,
                                     const double* effects,
                                     Eigen::Map<Eigen::Matrix3Xd>* readings) const {
  Eigen::MatrixXd E = Eigen::MatrixXd::Zero(3 * measured_.cols(), effects_->size());
  Eigen::Matrix3Xd of_sample(3, effects_->size());
  Eigen::Index n = 0;
  for (Eigen::Index i = 0; i < measured_.cols(); ++i) {
    const int samples = samples_[static_cast<size_t>(i)];
    for (const Eigen::Index end = n + samples; n < end; ++n) {
      Eigen::Vector3d rate = rates.col(i);
      if (base_.cols() > 0) rate += base_.col(n);
      readings->col(i) +=
          effects_->ChangeRate(times_s_[static_cast<size_t>(n)], rate, effects, of_sample) /
          samples;
      E.middleRows<3>(3 * i) += of_sample / samples;
    }
  }
  return E;
}

bool GyroRate::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  const Eigen::Index n = measured_.cols();
  const Eigen::Map<const Eigen::Matrix3Xd> rates(parameters[0], 3, n);
  const Eigen::Map<const Eigen::Vector3d> bias(parameters[1]);
  Eigen::Map<Eigen::Matrix3Xd> r(residuals, 3, n);
  r = (rates - measured_).colwise() + Eigen::Vector3d(bias);
  Eigen::MatrixXd E;
  if (effects_) E = AddEffects(rates, parameters[2], &r);
  r.array() *= inv_sigma_.array();
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> J(
        jacobians[0], 3 * n, 3 * n);
    J = inv_sigma_.reshaped().asDiagonal();
    if (effects_) {
      const Eigen::Matrix3d by_rate = effects_->RateByRate(parameters[2]);
      for (Eigen::Index i = 0; i < n; ++i) {
        J.block<3, 3>(3 * i, 3 * i) += inv_sigma_.col(i).asDiagonal() * by_rate;
      }
    }
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>> J(jacobians[1], 3 * n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      J.middleRows<3>(3 * i) = inv_sigma_.col(i).asDiagonal();
    }
  }
  if (effects_ && jacobians[2] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        jacobians[2], 3 * n, E.cols()) = inv_sigma_.reshaped().asDiagonal() * E;
  }
  return true;
}

}  // namespace camgyro
