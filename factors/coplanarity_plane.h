// Coplanarity of the cross products of matched rays, with the plane's normal as a parameter.
#ifndef CAMGYRO_FACTORS_COPLANARITY_PLANE_H_
#define CAMGYRO_FACTORS_COPLANARITY_PLANE_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>

#include "factors/pair_bearings.h"

namespace camgyro {

// The constraint of one match, and its derivatives.
//   r = tau . (a x b) / sigma,   sigma^2 = var_a |A' (b x tau)|^2 + var_b |B' (tau x a)|^2
// with a, b the two rays in the reference and A, B their derivatives by the pixels (3 x 2): the
// first-order standard deviation of the numerator, so r is the Sampson distance in sigmas.
struct PlaneResidual {
  double value = 0.0;
  Eigen::Vector3d by_a, by_b, by_tau;
  Eigen::Matrix<double, 3, 2> by_J_a, by_J_b;
};
PlaneResidual EvaluatePlaneResidual(const Eigen::Vector3d& a, const Eigen::Matrix<double, 3, 2>& A,
                                    const Eigen::Vector3d& b, const Eigen::Matrix<double, 3, 2>& B,
                                    const Eigen::Vector3d& tau, double variance_a,
                                    double variance_b);

// All matches of a pair against one plane, that may turn with the rows.
//
//   r_i = Robustify( tau_i . n_i / sigma_i ),  n_i = (R_i f_i) x (R'_i f'_i)          eq. (4)
//   tau_i = tau + s_i turn,   s_i = (v_i + v'_i) / 2h - 1/2
//
// Eq. (4) takes one translation direction for the whole pair. With a rolling shutter the top rows
// of the two frames are joined by an earlier stretch of the path than the bottom rows; where the
// path bends, their directions differ by the bend over t_r. `turn` is that change from top to
// bottom, and no product with t_r: the prior of a factor of t_r would pull on t_r.
//
// Parameters  lens         8   LensParameters
//             shutter      2   t_d [s], t_r [s]
//             q_gyro_cam   4   RotationManifold
//             tau          3   SphereManifold<3>: translation direction in the pair's reference,
//                              the gyro frame at the first rate (sign without meaning)
//             turn         3   change of tau from the top to the bottom row [rad]; give it a prior
//             effects      of PairMeasurement::effects, if there are any
//             rates        3 n_g each, one block per rate group, gyro frame [rad/s]
// Residual    one per match, in sigmas. sigma_i is propagated through lens, readout and rotation,
//             and differentiated with them.
// Valid       while every pixel has a ray; otherwise the step is rejected
// Source      Jia & Evans eq. (2)-(6); design.md section 3 and 5. Neglects: second-order noise,
//             directions that bend within the readout
class CoplanarityPlane final : public ceres::CostFunction {
 public:
  explicit CoplanarityPlane(std::shared_ptr<const PairMeasurement> pair);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  static constexpr int kTauBlock = 3;
  static constexpr int kTurnBlock = 4;
  static constexpr int kEffectsBlock = 5;  // the first rate group without effects

  // s_i of a match.
  static double RowShare(const PairMeasurement& pair, const Match& match) {
    return 0.5 * (match.px_a.y() + match.px_b.y()) / pair.size_px.y() - 0.5;
  }

 private:
  const std::shared_ptr<const PairMeasurement> pair_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_COPLANARITY_PLANE_H_
