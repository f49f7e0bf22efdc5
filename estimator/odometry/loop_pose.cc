#include "estimator/odometry/loop_pose.h"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/robust_statistics.h"

namespace camgyro {
namespace {

constexpr double kSightingLossSigmas = 2.0;
constexpr double kSightingOutlierSigmas = 4.0;
constexpr double kFirstSightingNoisePx = 1.0;
// Corners are found to so much at best, and points of the map are not better.
constexpr double kLeastSightingNoisePx = 0.2;
constexpr size_t kLeastPoseSightings = 6;
constexpr int kNoiseRounds = 3;  // of the noise and of who belongs
constexpr int kPoseIterations = 20;

}  // namespace

TurnAndTilt TurnBetween(const Eigen::Quaterniond& q_from, const Eigen::Vector3d& p_from_m,
                        const Eigen::Quaterniond& q_to, const Eigen::Vector3d& p_to_m,
                        const Eigen::Vector3d& pivot_m) {
  const Eigen::Quaterniond q = q_to * q_from.conjugate();
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const double turn_rad = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()));
  TurnAndTilt result;
  result.shift_turn << p_to_m - pivot_m - turn * (p_from_m - pivot_m), turn_rad;
  result.tilt_rad = q.angularDistance(turn);
  return result;
}

Result<LoopPose> FitLoopPose(const std::vector<TurnedProjection>& sightings,
                             const Eigen::Vector4d& first_guess) {
  const tl::unexpected<Error> failed = CannotEstimate("a loop's pose has no solution");
  LoopPose pose;
  pose.shift_turn = first_guess;
  pose.noise_px = kFirstSightingNoisePx;
  for (size_t i = 0; i < sightings.size(); ++i) pose.inliers.push_back(static_cast<int>(i));
  Eigen::Matrix4d information;
  for (int round = 0; round < kNoiseRounds; ++round) {
    if (pose.inliers.size() < kLeastPoseSightings) return failed;
    ceres::Problem problem;
    std::vector<ceres::ResidualBlockId> ids;
    for (const int i : pose.inliers) {
      TurnedProjection seen = sightings[static_cast<size_t>(i)];
      seen.sigma_px = pose.noise_px;
      ids.push_back(problem.AddResidualBlock(MakeTurnedProjection(seen).release(),
                                             new ceres::CauchyLoss(kSightingLossSigmas),
                                             pose.shift_turn.data()));
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = kPoseIterations;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return failed;

    information.setZero();
    std::vector<double> norms_px;
    std::vector<int> inliers;
    const double* const parameters[] = {pose.shift_turn.data()};
    for (size_t k = 0; k < ids.size(); ++k) {
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 4, Eigen::RowMajor> J;
      double* jacobians[] = {J.data()};
      const ceres::CostFunction* factor = problem.GetCostFunctionForResidualBlock(ids[k]);
      if (!factor->Evaluate(parameters, r.data(), jacobians)) continue;
      norms_px.push_back(r.norm() * pose.noise_px);
      if (r.norm() >= kSightingOutlierSigmas) continue;
      inliers.push_back(pose.inliers[k]);
      information += J.transpose() * J * (pose.noise_px * pose.noise_px);
    }
    pose.inliers = std::move(inliers);
    if (norms_px.empty()) return failed;
    // The median length of a unit normal vector in the plane is 1.177.
    pose.noise_px = std::max(kLeastSightingNoisePx, MedianInPlace(&norms_px) / 1.177);
  }
  if (pose.inliers.size() < kLeastPoseSightings) return failed;
  const Eigen::LLT<Eigen::Matrix4d> llt(information);
  if (llt.info() != Eigen::Success) return failed;
  pose.covariance = pose.noise_px * pose.noise_px * llt.solve(Eigen::Matrix4d::Identity()).eval();
  return pose;
}

}  // namespace camgyro
