#include "estimator/start/orientation.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/so3.h"
#include "estimator/start/axis_permutation.h"

namespace camgyro {
namespace {

constexpr double kDeterminedRad = 0.1;
constexpr double kConsistentRad = 0.35;  // 20 deg
constexpr double kMountingRad = 0.1;     // how far a chip may sit from its nominal axes, one sigma
constexpr double kChiSquareMargin = 4.0;

struct Move {
  Eigen::Quaterniond q_gyro_cam;
  double along_open_sigmas = 0.0;      // how far it moved, in sigmas of the open directions
  double across_determined_rad = 0.0;  // what is left to the target
};

// Turns q about the open directions only, to the point nearest to the target.
Move MoveTowards(const Eigen::Quaterniond& q, const Eigen::Quaterniond& target,
                 const Eigen::Matrix3d& open_projector, const Eigen::Matrix3d& open_information) {
  Move move{q, 0.0, 0.0};
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d all = Log(move.q_gyro_cam.conjugate() * target);
    const Eigen::Vector3d step = open_projector * all;
    move.q_gyro_cam = (move.q_gyro_cam * Exp(step)).normalized();
    if (step.norm() < 1e-9) break;
  }
  const Eigen::Vector3d moved = Log(q.conjugate() * move.q_gyro_cam);
  move.along_open_sigmas = std::sqrt(moved.dot(open_information * moved));
  move.across_determined_rad = Log(move.q_gyro_cam.conjugate() * target).norm();
  return move;
}

}  // namespace

Orientation CompleteOrientation(const Eigen::Quaterniond& q_gyro_cam,
                                const Eigen::Matrix3d& covariance,
                                const std::optional<Eigen::Quaterniond>& guess) {
  Orientation orientation;
  orientation.q_gyro_cam = q_gyro_cam;
  orientation.sigma_rad = covariance.diagonal().cwiseSqrt();

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  Eigen::Matrix3d open_projector = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d open_information = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d covariance_when_placed = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d v = eigen.eigenvectors().col(k);
    double variance = eigen.eigenvalues()[k];
    if (variance < kDeterminedRad * kDeterminedRad) {
      ++orientation.axes_determined;
    } else {
      open_projector += v * v.transpose();
      open_information += v * v.transpose() / variance;
      variance = kMountingRad * kMountingRad;
    }
    covariance_when_placed += variance * v * v.transpose();
  }
  if (orientation.axes_determined == 3) return orientation;

  const std::string what = "the motion determines " + std::to_string(orientation.axes_determined) +
                           " of the 3 directions of the camera's orientation on the gyro; ";
  if (guess) {
    const Move move =
        MoveTowards(q_gyro_cam, guess->normalized(), open_projector, open_information);
    if (move.across_determined_rad < kConsistentRad) {
      orientation.q_gyro_cam = move.q_gyro_cam;
      orientation.sigma_rad = covariance_when_placed.diagonal().cwiseSqrt();
      orientation.notes.push_back(what + "the rest is taken from the recording's guess");
      return orientation;
    }
    orientation.notes.push_back("the recording's guess of the orientation contradicts the motion");
  }

  // Misfit in sigmas, squared; the determined directions may be off by a tilted mounting.
  double best = -1.0, second = -1.0;
  Move nearest{q_gyro_cam, 0.0, 0.0};
  Eigen::Matrix3d nearest_permutation = Eigen::Matrix3d::Identity();
  for (const Eigen::Matrix3d& P : AxisPermutations(1)) {
    const Move move =
        MoveTowards(q_gyro_cam, Eigen::Quaterniond(P), open_projector, open_information);
    const double across = move.across_determined_rad / kMountingRad;
    const double cost = move.along_open_sigmas * move.along_open_sigmas + across * across;
    if (best < 0.0 || cost < best) {
      second = best;
      best = cost;
      nearest = move;
      nearest_permutation = P;
    } else if (second < 0.0 || cost < second) {
      second = cost;
    }
  }
  if (nearest.across_determined_rad < kConsistentRad && second - best > kChiSquareMargin) {
    orientation.q_gyro_cam = nearest.q_gyro_cam;
    orientation.sigma_rad = covariance_when_placed.diagonal().cwiseSqrt();
    orientation.notes.push_back(what + "the rest is taken from the nearest axis permutation, " +
                                DescribePermutation(nearest_permutation));
  } else {
    orientation.notes.push_back(what +
                                "the rest is open: no guess and no axis permutation fits "
                                "clearly better than another. Turn about a second axis");
  }
  return orientation;
}

}  // namespace camgyro
