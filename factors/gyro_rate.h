// The gyro's readings as measurements of the rates in the state.
#ifndef CAMGYRO_FACTORS_GYRO_RATE_H_
#define CAMGYRO_FACTORS_GYRO_RATE_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace camgyro {

//   r_n = (w_n + b_g - w_n_measured) / sigma
//
// Parameters  rates              3 n   one rate group, gyro frame [rad/s]
//             bias_gyro_rad_s    3     gyro frame
// Residual    3 n, in sigmas
// Source      design.md section 1 and 3: w_measured = w_true + b_g + noise. (Eq. (8) of Jia &
//             Evans writes the bias with the opposite sign.)
class GyroRate final : public ceres::CostFunction {
 public:
  // measured: one reading per column [rad/s]; sigma_rad_s > 0: white noise of one
  // reading, per axis.
  GyroRate(const Eigen::Matrix3Xd& measured_rad_s, const Eigen::Vector3d& sigma_rad_s);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const Eigen::Matrix3Xd measured_;
  const Eigen::Vector3d inv_sigma_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_GYRO_RATE_H_
