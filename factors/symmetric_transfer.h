// Rotation-only image residual: where a pure rotation would move each feature of a pair.
#ifndef CAMGYRO_FACTORS_SYMMETRIC_TRANSFER_H_
#define CAMGYRO_FACTORS_SYMMETRIC_TRANSFER_H_

#include <ceres/cost_function.h>

#include <memory>
#include <vector>

#include "factors/pair_bearings.h"

namespace camgyro {

// Matches of a pair, each transferred by the gyro's rotation from one frame into the other, both
// ways.
//
//   e_b = px_b - project( R_b^T R_a ray(px_a) ),   e_a = px_a - project( R_a^T R_b ray(px_b) )
//   r   = Robustify_norm( [e_b; e_a] / sqrt(2 (var_a + var_b)) )
//   R_a, R_b: the camera's orientation at the exposure of px_a, px_b
//
// Parameters  lens         kLensSize     LensParameters
//             shutter      kShutterSize  t_r [s], t_d [s]
//             q_gyro_cam   4   RotationManifold
//             rates        3 n_g each, one block per rate group, gyro frame [rad/s]
// Residual    four per match. The two directions repeat one error: the sum of the four squares is
//             chi-square with two degrees of freedom, to first order, and the loss takes its root
// Valid       while every pixel has a ray and its transfer a pixel; otherwise the step is rejected.
//             Neglects translation: it is for comparison, and for scenes so far away that parallax
//             does not show. Also neglects: that noise in v moves the row's time; local scale of
//             the transfer, TrackedPoint::noise_factor, and effects (CHECKed)
// Source      Ovren & Forssen, Gyroscope-based video stabilisation with auto-calibration, ICRA 2015
class SymmetricTransfer final : public ceres::CostFunction {
 public:
  explicit SymmetricTransfer(std::shared_ptr<const PairMeasurement> pair);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  // What is independent in the four residuals of each match, without loss: two in the direction of
  // e_b, as long as the four. Unit variance, to first order. Empty where Evaluate fails.
  std::vector<double> IndependentResiduals(double const* const* parameters) const;

  static constexpr int kFirstRateGroup = 3;
  static constexpr int kResidualsPerMatch = 4;

 private:
  const std::shared_ptr<const PairMeasurement> pair_;
};

// Whether a match has a residual: its transfer has a pixel both ways.
[[nodiscard]] bool HasTransfer(const Lens& model, const LensParameters& lens, const Bearing& a,
                               const Bearing& b);

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_SYMMETRIC_TRANSFER_H_
