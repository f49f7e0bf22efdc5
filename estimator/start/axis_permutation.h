// The 24 right-handed permutations of the axes: how a gyro chip usually sits to a camera.
#ifndef CAMGYRO_ESTIMATOR_START_AXIS_PERMUTATION_H_
#define CAMGYRO_ESTIMATOR_START_AXIS_PERMUTATION_H_

#include <Eigen/Core>
#include <string>
#include <vector>

namespace camgyro {

// Signed permutation matrices with the given determinant (+1: rotations, -1: one axis or all three
// with the wrong sign). 24 each, in a fixed order.
std::vector<Eigen::Matrix3d> AxisPermutations(int determinant);

struct NearestPermutation {
  Eigen::Matrix3d P_gyro_cam;
  double angle_rad = 0.0;  // of the rotation between it and the matrix asked for
};
// Nearest one to an orthogonal matrix of the same determinant.
NearestPermutation FindNearestPermutation(const Eigen::Matrix3d& R_gyro_cam);

// Camera axes along the gyro's, for people: "gyro (x, y, z) = camera (-y, -x, -z)".
std::string DescribePermutation(const Eigen::Matrix3d& P_gyro_cam);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_AXIS_PERMUTATION_H_
