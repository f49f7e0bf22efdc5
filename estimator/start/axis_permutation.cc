#include "estimator/start/axis_permutation.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace camgyro {

std::vector<Eigen::Matrix3d> AxisPermutations(int determinant) {
  std::vector<Eigen::Matrix3d> all;
  std::array<int, 3> axis = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) P(row, axis[row]) = (signs >> row) & 1 ? -1.0 : 1.0;
      if (std::lround(P.determinant()) == determinant) all.push_back(P);
    }
  } while (std::next_permutation(axis.begin(), axis.end()));
  return all;
}

NearestPermutation FindNearestPermutation(const Eigen::Matrix3d& R_gyro_cam) {
  NearestPermutation nearest;
  double best_trace = -4.0;
  for (const Eigen::Matrix3d& P : AxisPermutations(R_gyro_cam.determinant() < 0.0 ? -1 : 1)) {
    const double trace = (P.transpose() * R_gyro_cam).trace();
    if (trace > best_trace) {
      best_trace = trace;
      nearest.P_gyro_cam = P;
    }
  }
  nearest.angle_rad = std::acos(std::clamp(0.5 * (best_trace - 1.0), -1.0, 1.0));
  return nearest;
}

std::string DescribePermutation(const Eigen::Matrix3d& P_gyro_cam) {
  std::string text = "gyro (x, y, z) = camera (";
  for (int row = 0; row < 3; ++row) {
    int column = 0;
    P_gyro_cam.row(row).cwiseAbs().maxCoeff(&column);
    if (row > 0) text += ", ";
    if (P_gyro_cam(row, column) < 0.0) text += "-";
    text += "xyz"[column];
  }
  return text + ")";
}

}  // namespace camgyro
