// Agreement of two poses whose roll and pitch are known with the way measured between them.
#ifndef CAMGYRO_FACTORS_RELATIVE_YAW_POSITION_H_
#define CAMGYRO_FACTORS_RELATIVE_YAW_POSITION_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>

namespace camgyro {

//   r = S [ Rz(-yaw_a) (p_b - p_a) - p_a_b ;  wrap(yaw_b - yaw_a - yaw_a_b) ]
//   wrap(x): the angle of x within -pi to pi; S' S: inverse covariance of the measurement
//
// Parameters  pose_a, pose_b   4 each: p_w [m], z up; yaw [rad]
// Residual    4, in sigmas
// Valid       while wrap's argument is not at pi, where it has a step
// Source      the pose graph of Qin, Li & Shen, VINS-Mono, section VIII: what an odometry with an
//             accelerometer accumulates is an error of position and yaw, four degrees of freedom
struct RelativeYawPosition {
  Eigen::Vector3d p_a_b_m = Eigen::Vector3d::Zero();  // in the frame of a, turned upright
  double yaw_a_b_rad = 0.0;
  // Of (p_a_b_m, yaw_a_b_rad); positive definite.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
};
std::unique_ptr<ceres::CostFunction> MakeRelativeYawPosition(const RelativeYawPosition& measured);

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_RELATIVE_YAW_POSITION_H_
