// Agreement of a camera rotation with the gyro's rotation over the same, delay-shifted interval.
#ifndef CAMGYRO_FACTORS_RELATIVE_ROTATION_H_
#define CAMGYRO_FACTORS_RELATIVE_ROTATION_H_

#include <ceres/cost_function.h>

#include <memory>

#include "factors/pair_bearings.h"

namespace camgyro {

//   r = Robustify_norm( Log( R_gyro_b^T R_gyro_a * R_gyro_cam R_cama_camb R_gyro_cam^T ) / sigma )
//   R_gyro_a, R_gyro_b: the rotation chain at t_a + t_d + row t_r, t_b + t_d + row t_r
//
// Parameters  shutter      2   t_r [s], t_d [s]
//             q_gyro_cam   4   RotationManifold
//             effects      of PairMeasurement::effects, if there are any
//             times        1 and 1, with PairMeasurement::own_times: offsets of the two frames from
//                          their stamps [s]; give them a prior
//             rates        3 n_g each, one block per rate group, gyro frame [rad/s]
// Residual    3, in sigmas, in the gyro frame of the second exposure
// Valid       while the argument of Log turns by less than pi - 0.1 rad; the caller gates
// Source      Feng, Li & Dai eq. (2); docs/architecture.md, residuals. Neglects: that two
//             neighbouring camera rotations share the error of the attitude between them
class RelativeRotation final : public ceres::CostFunction {
 public:
  // pair: without matches, and with a value of its own for each rate (CHECKed).
  explicit RelativeRotation(std::shared_ptr<const PairMeasurement> pair);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  static constexpr int kEffectsBlock = 2;  // times, or the first rate group, without effects

 private:
  const std::shared_ptr<const PairMeasurement> pair_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_RELATIVE_ROTATION_H_
