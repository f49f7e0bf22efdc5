// Random walk of the gyro's bias between two of its parameter blocks.
#ifndef CAMGYRO_FACTORS_BIAS_WALK_H_
#define CAMGYRO_FACTORS_BIAS_WALK_H_

#include <ceres/sized_cost_function.h>

namespace camgyro {

//   r = (b_1 - b_0) / (density * sqrt(interval))
//
// Parameters  bias_0_gyro_rad_s, bias_1_gyro_rad_s   3 each, gyro frame
// Residual    3, in sigmas
// Source      Jia & Evans section V.A
class BiasWalk final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  // density_rad_s2_rtHz > 0: random-walk density of each axis [rad/s/sqrt(s)]; interval_s > 0.
  BiasWalk(double density_rad_s2_rtHz, double interval_s);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const double inv_sigma_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_BIAS_WALK_H_
