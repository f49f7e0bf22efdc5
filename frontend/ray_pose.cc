#include "frontend/ray_pose.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace camgyro {
namespace {

constexpr int kRansacIterations = 300;
constexpr double kRansacConfidence = 0.999;

}  // namespace

std::optional<RayPose> PoseFromRays(const std::vector<Eigen::Vector3d>& points_world_m,
                                    const std::vector<Eigen::Vector3d>& rays_cam,
                                    double threshold) {
  if (points_world_m.size() < 4 || points_world_m.size() != rays_cam.size()) return std::nullopt;
  // OpenCV computes with floats here: counted from the points' middle.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points_world_m) middle += point;
  middle /= static_cast<double>(points_world_m.size());
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (size_t i = 0; i < rays_cam.size(); ++i) {
    const Eigen::Vector3d point = points_world_m[i] - middle;
    points.emplace_back(point.x(), point.y(), point.z());
    pixels.emplace_back(rays_cam[i].x() / rays_cam[i].z(), rays_cam[i].y() / rays_cam[i].z());
  }
  cv::Vec3d turn, shift;
  cv::Mat inliers;
  try {
    if (!cv::solvePnPRansac(points, pixels, cv::Matx33d::eye(), cv::noArray(), turn, shift,
                            /*useExtrinsicGuess=*/false, kRansacIterations,
                            static_cast<float>(threshold), kRansacConfidence, inliers,
                            cv::SOLVEPNP_AP3P)) {
      return std::nullopt;
    }
  } catch (const cv::Exception&) {  // of points in a degenerate place
    return std::nullopt;
  }
  const Eigen::Vector3d axis(turn[0], turn[1], turn[2]), t(shift[0], shift[1], shift[2]);
  if (!axis.allFinite() || !t.allFinite()) return std::nullopt;
  RayPose pose;
  const double angle = axis.norm();
  if (angle > 0.0) pose.q_world_cam = Eigen::AngleAxisd(-angle, axis / angle);
  pose.p_world_m = middle - pose.q_world_cam * t;
  for (int i = 0; i < static_cast<int>(inliers.total()); ++i) {
    pose.inliers.push_back(inliers.at<int>(i));
  }
  std::sort(pose.inliers.begin(), pose.inliers.end());
  return pose;
}

}  // namespace camgyro
