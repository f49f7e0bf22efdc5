// A landmark seen by a rolling shutter: each observation at the time of its own row.
#ifndef CAMGYRO_FACTORS_ROW_PROJECTION_H_
#define CAMGYRO_FACTORS_ROW_PROJECTION_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>

#include "core/imu_integral.h"
#include "core/lens.h"

namespace camgyro {

//   t       = exposure of the row, moved by dt = d(t_d) + d(t_r) row_fraction from where it was
//   R(t)    = R_w_k q_k_t Exp(J db_g) Exp(omega dt)                  (q_k_t: inertial, node to row)
//   p(t)    = p_k + v_k T + g T^2 / 2 + R_w_k dp + (v_k + g T + R_w_k dv) dt
//   s       = R_gyro_cam' R(t)' ( X - w (p(t) + R(t) p_gyro_cam) ),  R_gyro_cam = R(q) Exp(d q)
//   r       = ( ray(pixel) - s / s_z ) in pixels / sigma_px; the ray, and pixels per ray, are moved
//             by d(f, c) to first order
//
// Parameters  q_w_gyro 4, p_w 3 [m], v_w 3 [m/s]   of the node: a keyframe's time
//             gravity_w 3       unit vector; times gravity_m_s2
//             p_gyro_cam 3      camera in the gyro frame [m]
//             calibration 11    deviation from the calibration that row times, rays and deltas were
//                               made with, in the order of StateIndex
//             point 4           homogeneous (X, w), unit norm: points at any distance (w < 0: seen
//                                beyond infinity, as noise may have it)
// Residual    2, in sigmas. The derivatives are analytic: it is evaluated more often than any
//             other factor of the odometry
// Valid       for points before the camera (else the evaluation fails); |T| below 0.1 s, since the
//             accelerometer's bias is neglected in between (1e-3 m at 0.2 m/s^2)
struct RowProjectionMeasurement {
  ImuDelta node_to_row;
  Eigen::Vector3d omega_gyro_rad_s = Eigen::Vector3d::Zero();  // at the row
  double row_fraction = 0.0;                                   // v / h
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();
  RayJet ray;  // of the pixel, with its derivatives by the lens
  double sigma_px = 1.0;
  double gravity_m_s2 = 9.80665;
};
std::unique_ptr<ceres::CostFunction> MakeRowProjection(const RowProjectionMeasurement& m);

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_ROW_PROJECTION_H_
