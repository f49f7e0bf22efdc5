// Where the camera was and what it saw, up to one scale: translations from tracks, with the gyro's
// rotations taken as known. Step (b) of the VINS initialisation.
#ifndef CAMGYRO_ESTIMATOR_VINS_STRUCTURE_H_
#define CAMGYRO_ESTIMATOR_VINS_STRUCTURE_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/result.h"
#include "estimator/vins/vins_window.h"

namespace camgyro {

struct VinsStructure {
  Eigen::Matrix3Xd centres;  // camera centres at the keyframes' times; the first is zero
  // Points in the same frame and scale; nothing for tracks that contradict the motion.
  std::vector<std::optional<Eigen::Vector3d>> points;
  double noise_rad = 0.0;     // robust spread of the directions about the points, per axis
  double parallax_rad = 0.0;  // largest angle between two sightings of a point, median
};

// Minimises the distances of the points from their viewing lines, weighted by 1 / distance^2 (then
// they are angles) and by Geman and McClure's loss. Given the rotations the problem is linear in
// centres and points together: the points are eliminated, and the centres are the eigenvector of
// the smallest eigenvalue; the weights follow in a few rounds. Rows are exposed at their own times:
// within a frame the centre moves along the chord of the neighbouring keyframes.
// Errors: kCannotEstimate if fewer than 15 points lie before the camera.
Result<VinsStructure> FindStructure(const VinsWindow& window);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_VINS_STRUCTURE_H_
