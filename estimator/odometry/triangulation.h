// A point from the lines along which it was seen.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_TRIANGULATION_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_TRIANGULATION_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace camgyro {

struct ViewingLine {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();    // of the camera
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // towards the point, unit
};

// The largest angle between two of the directions [rad].
double Parallax(const std::vector<ViewingLine>& lines);

// The point with the least sum of squared angles to its lines (a linear problem, weighted by the
// distances, in two rounds). Nothing with fewer than two lines, with less parallax than this, with
// the point behind a camera, or if a direction misses it by more than `max_error_rad`.
std::optional<Eigen::Vector3d> Triangulate(const std::vector<ViewingLine>& lines,
                                           double min_parallax_rad, double max_error_rad);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_TRIANGULATION_H_
