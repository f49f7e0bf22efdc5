// A point of one map seen by a camera that another map knows, where the maps differ by a turn about
// the vertical and a shift.
#ifndef CAMGYRO_FACTORS_TURNED_PROJECTION_H_
#define CAMGYRO_FACTORS_TURNED_PROJECTION_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>

#include "core/lens.h"

namespace camgyro {

//   X'  = Rz(turn) (X - pivot) + pivot + shift
//   s   = R_world_cam' (X' - p_cam)
//   r   = ( ray(pixel) - s / s_z ) in pixels / sigma_px
//
// Parameters  shift_turn   4   shift [m], turn [rad]
// Residual    2, in sigmas
// Valid       for points before the camera (else the evaluation fails)
// Source      perspective of known points, with roll and pitch known from gravity. The camera is
//             that of the pixel's row. Neglects: noise of X and of the camera
struct TurnedProjection {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();  // X
  Eigen::Vector3d pivot_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_world_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_cam_m = Eigen::Vector3d::Zero();
  RayJet ray;  // of the pixel
  double sigma_px = 1.0;
};
std::unique_ptr<ceres::CostFunction> MakeTurnedProjection(const TurnedProjection& seen);

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_TURNED_PROJECTION_H_
