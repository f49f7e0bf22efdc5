// The gyro's readings as measurements of the rates in the state.
#ifndef CAMGYRO_FACTORS_GYRO_RATE_H_
#define CAMGYRO_FACTORS_GYRO_RATE_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/effects/catalogue.h"

namespace camgyro {

//   r_n = (w_n + b_g + E_n(w_n, e) - w_n_measured) / sigma,  E: EffectSet::ChangeRate
//
// or, of the means of some samples each, whose rates are known but for a correction x_k that they
// share,
//
//   r_k = (x_k + b_g + mean E_n(w0_n + x_k, e) - x_k_measured) sqrt(samples) / sigma
//
// Parameters  rates              3 n   one rate group, gyro frame [rad/s]
//             bias_gyro_rad_s    3     gyro frame
//             effects            e, if there are any (core/effects)
// Residual    3 n, in sigmas
// Source      docs/architecture.md, conventions: w_measured = w_true + b_g + noise. (Eq. (8) of
//             Jia & Evans writes the bias with the opposite sign.)
class GyroRate final : public ceres::CostFunction {
 public:
  // measured: one reading per column [rad/s]; sigma_rad_s > 0: white noise of one
  // reading, per axis.
  // effects: null, or with parameters; then times_s are those of the readings.
  GyroRate(const Eigen::Matrix3Xd& measured_rad_s, const Eigen::Vector3d& sigma_rad_s,
           std::shared_ptr<const EffectSet> effects = nullptr, std::vector<double> times_s = {});
  // Readings that are means of some samples; sigma: of one sample. With effects: base_rad_s (w0)
  // and times of all these samples.
  GyroRate(const Eigen::Matrix3Xd& measured_rad_s, std::vector<int> samples,
           const Eigen::Vector3d& sigma_rad_s, std::shared_ptr<const EffectSet> effects = nullptr,
           std::vector<double> times_s = {}, Eigen::Matrix3Xd base_rad_s = {});

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  // Adds the effects' change of all readings at these rates to `readings`; returns its derivatives
  // by the effects, those of the readings one below the other.
  Eigen::MatrixXd AddEffects(const Eigen::Map<const Eigen::Matrix3Xd>& rates, const double* effects,
                             Eigen::Map<Eigen::Matrix3Xd>* readings) const;

  const Eigen::Matrix3Xd measured_;
  Eigen::Matrix3Xd inv_sigma_;  // of each reading
  const std::shared_ptr<const EffectSet> effects_;
  const std::vector<double> times_s_;  // of the samples
  std::vector<int> samples_;           // of each reading
  Eigen::Matrix3Xd base_;              // of the samples; empty: zero
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_GYRO_RATE_H_
