#include "estimator/odometry/triangulation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace camgyro {

double Parallax(const std::vector<ViewingLine>& lines) {
  double least_cosine = 1.0;
  for (size_t i = 0; i < lines.size(); ++i) {
    for (size_t j = i + 1; j < lines.size(); ++j) {
      least_cosine = std::min(least_cosine, lines[i].direction.dot(lines[j].direction));
    }
  }
  return std::acos(std::max(-1.0, least_cosine));
}

std::optional<Eigen::Vector3d> Triangulate(const std::vector<ViewingLine>& lines,
                                           double min_parallax_rad, double max_error_rad) {
  if (lines.size() < 2 || Parallax(lines) < min_parallax_rad) return std::nullopt;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int round = 0; round < 2; ++round) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const ViewingLine& line : lines) {
      const Eigen::Matrix3d across =
          Eigen::Matrix3d::Identity() - line.direction * line.direction.transpose();
      const double distance_sq = (point - line.centre_m).squaredNorm();
      const double weight = round == 0 ? 1.0 : 1.0 / std::max(1e-6, distance_sq);
      A += weight * across;
      b += weight * across * line.centre_m;
    }
    point = A.ldlt().solve(b);
    if (!point.allFinite()) return std::nullopt;
  }
  for (const ViewingLine& line : lines) {
    const Eigen::Vector3d seen = point - line.centre_m;
    const double along = seen.dot(line.direction);
    const double aside = (seen - along * line.direction).norm();
    if (!(along > 0.0) || std::atan2(aside, along) > max_error_rad) return std::nullopt;
  }
  return point;
}

}  // namespace camgyro
