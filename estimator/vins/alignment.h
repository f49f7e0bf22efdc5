// Velocities, gravity, scale and accelerometer bias from structure and pre-integrated inertial
// data. Steps (c) and the first half of (d) of the VINS initialisation.
#ifndef CAMGYRO_ESTIMATOR_VINS_ALIGNMENT_H_
#define CAMGYRO_ESTIMATOR_VINS_ALIGNMENT_H_

#include <Eigen/Core>

#include "core/result.h"
#include "estimator/vins/structure.h"
#include "estimator/vins/vins_window.h"

namespace camgyro {

struct VinsAlignment {
  double scale = 0.0;                                       // metres per unit of the structure
  Eigen::Vector3d gravity_world = Eigen::Vector3d::Zero();  // [m/s^2], of the standard length
  double free_gravity_m_s2 = 0.0;                           // length that the data gave it before
  Eigen::Vector3d bias_accel_m_s2 = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd p_world_m;  // of the gyro frame at the keyframes; the first is zero
  Eigen::Matrix3Xd v_world_m_s;
};

// Least squares over velocities v_i, gravity g, scale s and bias b_a, all linear:
//   s (c_j - c_i) - (R_j - R_i) p_gyro_cam - v_i dt - g dt^2 / 2 = R_i (dp + J_dp_ba b_a)
//   v_j - v_i - g dt                                            = R_i (dv + J_dv_ba b_a)
// for neighbouring keyframes i, j; c: camera centres of the structure. Both kinds of equations are
// weighted by their residuals' spread, in a few rounds; b_a has a prior of bias_sigma_m_s2 around
// zero. Then g = gravity_m_s2 * unit vector, its tangent updated with all others until it stands.
// Error: kCannotEstimate if the scale comes out at zero or below.
Result<VinsAlignment> AlignWithInertial(const VinsWindow& window, const VinsStructure& structure,
                                        const Eigen::Vector3d& p_gyro_cam_m, double bias_sigma_m_s2,
                                        double gravity_m_s2);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_VINS_ALIGNMENT_H_
