// Completes an orientation where the motion leaves it open.
#ifndef CAMGYRO_ESTIMATOR_START_ORIENTATION_H_
#define CAMGYRO_ESTIMATOR_START_ORIENTATION_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

namespace camgyro {

struct Orientation {
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d sigma_rad = Eigen::Vector3d::Zero();  // about the camera's axes
  int axes_determined = 0;                              // by the motion, to kDeterminedRad
  std::vector<std::string> notes;
};

// `covariance`: of the right perturbation of q_gyro_cam [rad^2]; its eigenvectors with a sigma
// above 0.1 rad are what the motion leaves open (turning about one axis only: the angle about that
// axis). There, and only there, the rotation is moved to the guess if that agrees with the
// determined directions within 20 deg, else to the nearest axis permutation that does, provided
// that the data prefer it to the second nearest by more than 2 sigma. Otherwise it stays, with its
// large sigma, and a note says so.
Orientation CompleteOrientation(const Eigen::Quaterniond& q_gyro_cam,
                                const Eigen::Matrix3d& covariance,
                                const std::optional<Eigen::Quaterniond>& guess);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_ORIENTATION_H_
