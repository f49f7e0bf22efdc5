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
// Its value alone.
double PlaneResidualValue(const Eigen::Vector3d& a, const Eigen::Matrix<double, 3, 2>& A,
                          const Eigen::Vector3d& b, const Eigen::Matrix<double, 3, 2>& B,
                          const Eigen::Vector3d& tau, double variance_a, double variance_b);

// Turn and bow of a pair's translation direction (or their standard deviations); see below.
using BendVector = Eigen::Matrix<double, 6, 1>;

// All matches of a pair against one plane, that may bend with the rows.
//
//   r_i = Robustify( tau_i . n_i / sigma_i ),  n_i = (R_i f_i) x (R'_i f'_i)          eq. (4)
//   tau_i = tau + s_i turn + c_i bow
//   s_i = (p_i + p'_i) / 2 - 1/2,   d_i = p'_i - p_i,   c_i = d_i + rho (6 s_i^2 + d_i^2 / 2)
//
// Eq. (4) takes one translation direction for the whole pair. With a rolling shutter every match is
// joined by a stretch of the path of its own. From u to u' on a path with velocity v, acceleration
// a and jerk j at the middle of the pair it goes (u' - u) (v + a (u + u') / 2 + j (u^2 + u u' +
// u'^2) / 6): with u, u' by the rows, and up to a length that changes nothing, that is tau_i, with
// p = v / h, turn = a t_r / |v|, bow = j t_r T / 12 |v| and rho = t_r / T, T the time between the
// frames. turn and bow are no products with t_r here: the prior of a factor of t_r would pull on
// t_r. (Without bow, the steps of somebody who runs leave b_y, c_y, t_r, t_d 0.8 to 0.4 sigmas off
// at 0.5 px.) Where columns are read as well or instead, p is how far the readout has come at a
// pixel, and t_r what takes longer (Scan; with p by the rows, columns of 20 ms leave c_x and q_y of
// somebody who walks 2 to 6 sigmas off: CalibrateRecording.OfAPictureThatWasTurned).
//
// Parameters  lens         kLensSize     LensParameters
//             shutter      kShutterSize  t_r [s], t_d [s]
//             q_gyro_cam   4   RotationManifold
//             tau          3   SphereManifold<3>: translation direction in the pair's reference,
//                              the gyro frame at the first rate (sign without meaning)
//             bend         6   turn: change of tau from the top to the bottom row [rad], and bow
//                              [rad]; give them a prior
//             effects      of PairMeasurement::effects, if there are any
//             times        1 and 1, with PairMeasurement::own_times: offsets of the two frames from
//                          their stamps [s]; give them a prior
//             rates        3 n_g each, one block per rate group, gyro frame [rad/s]
// Residual    one per match, in sigmas. sigma_i is propagated through lens, readout and rotation,
//             and differentiated with them.
// Valid       while every pixel has a ray; otherwise the step is rejected
// Source      Jia & Evans eq. (2)-(6); docs/architecture.md, residuals and traps. Neglects:
//             second-order noise, a jerk that changes within the pair
class CoplanarityPlane final : public ceres::CostFunction {
 public:
  explicit CoplanarityPlane(std::shared_ptr<const PairMeasurement> pair);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  static constexpr int kTauBlock = 3;
  static constexpr int kBendBlock = 4;
  static constexpr int kEffectsBlock = 5;  // times, or the first rate group, without effects

  // s_i and c_i of a match: by how much turn and bow move its direction.
  static Eigen::Vector2d BendShares(const PairMeasurement& pair, const Match& match) {
    const Eigen::Vector2d mean = 0.5 * (match.px_a + match.px_b).cwiseQuotient(pair.size_px);
    const Eigen::Vector2d moved = (match.px_b - match.px_a).cwiseQuotient(pair.size_px);
    const double s = pair.scan_shares.dot((mean.array() - 0.5).matrix());
    const double d = pair.scan_shares.dot(moved);
    return {s, d + pair.readout_over_gap * (6.0 * s * s + 0.5 * d * d)};
  }

 private:
  const std::shared_ptr<const PairMeasurement> pair_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_COPLANARITY_PLANE_H_
