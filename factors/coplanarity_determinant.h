// The paper's residual: three matches, one determinant.
#ifndef CAMGYRO_FACTORS_COPLANARITY_DETERMINANT_H_
#define CAMGYRO_FACTORS_COPLANARITY_DETERMINANT_H_

#include <ceres/cost_function.h>

#include <array>
#include <memory>
#include <vector>

#include "factors/pair_bearings.h"

namespace camgyro {

// Triplets of matches of a pair.
//
//   r = Robustify( det(n_1, n_2, n_3) / sigma ),  n_i = (R_i f_i) x (R'_i f'_i)      eq. (4), (9)
//
// Parameters  lens         kLensSize     LensParameters
//             shutter      kShutterSize  t_r [s], t_d [s]
//             q_gyro_cam   4   RotationManifold
//             effects      of PairMeasurement::effects, if there are any
//             rates        3 n_g each, one block per rate group, gyro frame [rad/s]
// Residual    one per triplet, in sigmas: first-order propagation of the noise of all six rays,
//             differentiated with the parameters
// Valid       while every pixel has a ray. Where all n are near zero (no parallax) sigma vanishes
//             with the numerator, and the first order is not enough: use CoplanarityPlane there
// Source      Jia & Evans eq. (4)-(6), (9). Neglects: triplets that share a match are correlated
class CoplanarityDeterminant final : public ceres::CostFunction {
 public:
  using Triplet = std::array<int, 3>;  // indices into PairMeasurement::matches

  CoplanarityDeterminant(std::shared_ptr<const PairMeasurement> pair,
                         std::vector<Triplet> triplets);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  static constexpr int kEffectsBlock = 3;  // the first rate group without effects

 private:
  const std::shared_ptr<const PairMeasurement> pair_;
  const std::vector<Triplet> triplets_;
};

// `count` random triplets of different matches out of `num_matches` (>= 3), repeatable by seed.
std::vector<CoplanarityDeterminant::Triplet> RandomTriplets(int num_matches, int count,
                                                            uint64_t seed);

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_COPLANARITY_DETERMINANT_H_
