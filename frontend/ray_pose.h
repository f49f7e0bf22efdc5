// Where a camera was that sees known points, some of which are not what they are taken for.
#ifndef CAMGYRO_FRONTEND_RAY_POSE_H_
#define CAMGYRO_FRONTEND_RAY_POSE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace camgyro {

struct RayPose {
  Eigen::Quaterniond q_world_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();  // of the camera
  std::vector<int> inliers;                             // ascending
};

// RANSAC over the perspective of three and four points (OpenCV's solvePnPRansac; the same input
// gives the same result). `rays_cam`: directions in the camera frame, all at one time, z > 0; ray i
// sees point i. Inliers are off by less than `threshold` on the plane z = 1. Nothing with fewer
// than four points, or if it finds no pose.
std::optional<RayPose> PoseFromRays(const std::vector<Eigen::Vector3d>& points_world_m,
                                    const std::vector<Eigen::Vector3d>& rays_cam, double threshold);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_RAY_POSE_H_
