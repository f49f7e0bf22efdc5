// Where the map of a newer keyframe lies in that of an older one that sees the same points.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_LOOP_POSE_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_LOOP_POSE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "core/result.h"
#include "factors/turned_projection.h"

namespace camgyro {

// Shift and turn of the newer map about its keyframe, so that it lies on the older one's. The
// order of rows: shift [m], turn about z [rad].
struct LoopPose {
  Eigen::Vector4d shift_turn = Eigen::Vector4d::Zero();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double noise_px = 0.0;     // of a matched descriptor, per axis
  std::vector<int> inliers;  // of the sightings, ascending
};

// A turn and a shift that take one pose into another, as far as a turn about z can; and by how much
// their roll and pitch differ then.
struct TurnAndTilt {
  Eigen::Vector4d shift_turn = Eigen::Vector4d::Zero();
  double tilt_rad = 0.0;
};
TurnAndTilt TurnBetween(const Eigen::Quaterniond& q_from, const Eigen::Vector3d& p_from_m,
                        const Eigen::Quaterniond& q_to, const Eigen::Vector3d& p_to_m,
                        const Eigen::Vector3d& pivot_m);

// The most likely shift and turn for points of the newer map (TurnedProjection::point_m) that the
// older keyframe's camera sees, each at its row's pose; sigma_px of the sightings is not used: the
// noise is estimated from them. Sightings beyond 4 sigma leave. Error: kCannotEstimate with fewer
// than six sightings left, or without a solution.
Result<LoopPose> FitLoopPose(const std::vector<TurnedProjection>& sightings,
                             const Eigen::Vector4d& first_guess);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_LOOP_POSE_H_
