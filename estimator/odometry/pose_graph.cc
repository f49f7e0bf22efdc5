#include "estimator/odometry/pose_graph.h"

#include <ceres/covariance.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/linear_algebra.h"

namespace camgyro {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kLoopLossSigmas = 2.0;
constexpr double kLoopOutlierSigmas = 5.0;
// What the window knows of the way between two keyframes at best: far below what it accumulates
// over seconds, and enough for a covariance that can be inverted.
constexpr double kLeastWayM = 1e-3, kLeastTurnRad = 1e-4;
constexpr int kGraphIterations = 100;
// A sum of squares this many of its standard deviations above what it should be is no chance.
constexpr double kChanceSigmas = 3.0;

// What a change of (position, yaw) does to the state, yaw about the position itself.
Eigen::Matrix<double, kNavSize, 4> StateByPose(const NavigationState& state) {
  Eigen::Matrix<double, kNavSize, 4> J = Eigen::Matrix<double, kNavSize, 4>::Zero();
  J.block<3, 3>(kNavPosition, 0).setIdentity();
  J.block<3, 1>(kNavRotation, 3) = state.q_world_gyro.conjugate() * Vector3d::UnitZ();
  J.block<3, 1>(kNavVelocity, 3) = Vector3d::UnitZ().cross(state.v_world_m_s);
  return J;
}

// Of (position, yaw) in the world.
Matrix4d PoseCovariance(const OdometryPose& pose) {
  Eigen::Matrix<double, 4, kNavSize> J = Eigen::Matrix<double, 4, kNavSize>::Zero();
  J.block<3, 3>(0, kNavPosition).setIdentity();
  J.block<1, 3>(3, kNavRotation) = pose.state.q_world_gyro.toRotationMatrix().row(2);
  return J * pose.covariance * J.transpose();
}

// One problem; `poses` is contiguous, so that the order of its blocks is that of the keyframes
// whatever their addresses are, and the result the same in its last digit.
class Graph {
 public:
  Graph(const std::vector<OdometryPose>& keyframes, std::vector<Vector4d>* poses) : poses_(*poses) {
    for (Vector4d& pose : poses_) problem_.AddParameterBlock(pose.data(), 4);
    problem_.SetParameterBlockConstant(poses_.front().data());
    for (size_t i = 0; i + 1 < keyframes.size(); ++i) {
      Add({i, i + 1, WayBetween(keyframes[i], keyframes[i + 1])}, nullptr);
    }
  }

  ceres::ResidualBlockId AddLoop(const LoopEdge& loop) {
    return Add(loop, new ceres::CauchyLoss(kLoopLossSigmas));
  }

  double Sigmas(ceres::ResidualBlockId loop) {
    Vector4d residual;
    problem_.EvaluateResidualBlock(loop, /*apply_loss_function=*/false, nullptr, residual.data(),
                                   nullptr);
    return residual.norm();
  }
  void Remove(ceres::ResidualBlockId loop) { problem_.RemoveResidualBlock(loop); }

  bool Solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = kGraphIterations;
    options.function_tolerance = 1e-9;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  // Of ways and loops, with the loops' loss.
  double ChiSquared() {
    double half = 0.0;
    problem_.Evaluate({}, &half, nullptr, nullptr, nullptr);
    return 2.0 * half;
  }

  // Of every keyframe but the first, which is the frame of all; empty if it cannot be had.
  std::vector<Matrix4d> Covariances() {
    std::vector<std::pair<const double*, const double*>> blocks;
    for (const Vector4d& pose : poses_) blocks.emplace_back(pose.data(), pose.data());
    ceres::Covariance::Options options;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    if (!covariance.Compute(blocks, &problem_)) return {};
    std::vector<Matrix4d> result;
    for (const Vector4d& pose : poses_) {
      Eigen::Matrix<double, 4, 4, Eigen::RowMajor> block;
      covariance.GetCovarianceBlock(pose.data(), pose.data(), block.data());
      result.emplace_back(block);
    }
    return result;
  }

 private:
  ceres::ResidualBlockId Add(const LoopEdge& edge, ceres::LossFunction* loss) {
    return problem_.AddResidualBlock(MakeRelativeYawPosition(edge.measured).release(), loss,
                                     poses_[edge.older].data(), poses_[edge.newer].data());
  }

  std::vector<Vector4d>& poses_;
  ceres::Problem problem_;
};

// A frame that is a keyframe: before, and as the keyframe is now.
struct Anchor {
  const OdometryPose* before;
  const OdometryPose* now;
};

// As if the frame were fixed to the anchor.
NavigationState MovedBy(const Anchor& anchor, NavigationState state) {
  const NavigationState &before = anchor.before->state, &now = anchor.now->state;
  const Eigen::Quaterniond turn = now.q_world_gyro * before.q_world_gyro.conjugate();
  state.q_world_gyro = (turn * state.q_world_gyro).normalized();
  state.p_world_m = now.p_world_m + turn * (state.p_world_m - before.p_world_m);
  state.v_world_m_s = now.v_world_m_s + turn * (state.v_world_m_s - before.v_world_m_s);
  return state;
}

OdometryPose MovedTo(const OdometryPose& from, const Vector4d& pose, const Matrix4d& covariance) {
  OdometryPose moved = from;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(pose[3], Vector3d::UnitZ()));
  moved.state.q_world_gyro = (turn * from.state.q_world_gyro).normalized();
  moved.state.v_world_m_s = turn * from.state.v_world_m_s;
  moved.state.p_world_m = pose.head<3>();
  const auto J = StateByPose(moved.state);
  moved.covariance += J * (covariance - PoseCovariance(moved)) * J.transpose();
  return moved;
}

}  // namespace

RelativeYawPosition WayBetween(const OdometryPose& a, const OdometryPose& b) {
  const Vector3d way_m = b.state.p_world_m - a.state.p_world_m;
  RelativeYawPosition way;
  way.p_a_b_m = way_m;
  Matrix4d F = Matrix4d::Identity();
  F.block<3, 1>(0, 3) = Vector3d::UnitZ().cross(way_m);
  const Matrix4d increment = PoseCovariance(b) - F * PoseCovariance(a) * F.transpose();
  // In units of the least sigmas, eigenvalues of at least one.
  const Vector4d least(kLeastWayM, kLeastWayM, kLeastWayM, kLeastTurnRad);
  const Vector4d unit = least.cwiseInverse();
  const SymmetricSpectrum eigen =
      SpectrumOfSymmetric(unit.asDiagonal() * increment * unit.asDiagonal());
  way.covariance = least.asDiagonal() * eigen.vectors * eigen.values.cwiseMax(1.0).asDiagonal() *
                   eigen.vectors.transpose() * least.asDiagonal();
  return way;
}

Result<ClosedLoops> CloseLoops(const std::vector<OdometryPose>& keyframes,
                               const std::vector<LoopEdge>& loops) {
  for (const LoopEdge& loop : loops) {
    if (loop.older >= loop.newer || loop.newer >= keyframes.size()) {
      return BadInput("pose graph: a loop between keyframes that are not there");
    }
  }
  ClosedLoops closed;
  closed.keyframes = keyframes;
  closed.believed.assign(loops.size(), false);
  if (loops.empty()) return closed;

  std::vector<Vector4d> poses(keyframes.size(), Vector4d::Zero());
  for (size_t i = 0; i < keyframes.size(); ++i) {
    poses[i].head<3>() = keyframes[i].state.p_world_m;
  }
  Graph graph(keyframes, &poses);
  std::vector<ceres::ResidualBlockId> ids;
  for (const LoopEdge& loop : loops) ids.push_back(graph.AddLoop(loop));
  const tl::unexpected<Error> failed = CannotEstimate("the pose graph has no solution");
  if (!graph.Solve()) return failed;
  for (size_t i = 0; i < loops.size(); ++i) {
    closed.believed[i] = graph.Sigmas(ids[i]) < kLoopOutlierSigmas;
  }
  for (size_t i = 0; i < loops.size(); ++i) {
    if (!closed.believed[i]) graph.Remove(ids[i]);
  }
  const auto believed = std::count(closed.believed.begin(), closed.believed.end(), true);
  if (believed == 0) return closed;
  if (!graph.Solve()) return failed;
  const std::vector<Matrix4d> covariances = graph.Covariances();
  if (covariances.empty()) return failed;
  // Each loop brings four residuals, and all else is determined without it.
  const double dof = 4.0 * static_cast<double>(believed), chi_squared = graph.ChiSquared();
  closed.variance_factor = chi_squared / dof;
  const bool by_chance = chi_squared < dof + kChanceSigmas * std::sqrt(2.0 * dof);
  const double widening = by_chance ? 1.0 : closed.variance_factor;
  for (size_t i = 1; i < keyframes.size(); ++i) {
    closed.keyframes[i] = MovedTo(keyframes[i], poses[i], widening * covariances[i]);
  }
  return closed;
}

std::vector<OdometryPose> MoveWithKeyframes(const std::vector<OdometryPose>& frames,
                                            const std::vector<OdometryPose>& keyframes) {
  std::map<int64_t, const OdometryPose*> keyframe_by_stamp;
  for (const OdometryPose& keyframe : keyframes) {
    keyframe_by_stamp[keyframe.frame_stamp_ns] = &keyframe;
  }
  std::map<int, std::map<int64_t, Anchor>> by_segment;  // by time
  for (const OdometryPose& frame : frames) {
    const auto keyframe = keyframe_by_stamp.find(frame.frame_stamp_ns);
    if (keyframe == keyframe_by_stamp.end()) continue;
    by_segment[frame.segment][frame.time_ns] = {&frame, keyframe->second};
  }
  std::vector<OdometryPose> moved = frames;
  for (OdometryPose& frame : moved) {
    const auto anchors = by_segment.find(frame.segment);
    if (anchors == by_segment.end()) continue;
    auto next = anchors->second.lower_bound(frame.time_ns);
    if (next == anchors->second.end()) --next;
    auto last = next;
    if (last != anchors->second.begin() && frame.time_ns < next->first) --last;
    const double share = next == last || frame.time_ns > next->first
                             ? 1.0
                             : static_cast<double>(frame.time_ns - last->first) /
                                   static_cast<double>(next->first - last->first);
    const NavigationState a = MovedBy(last->second, frame.state);
    const NavigationState b = MovedBy(next->second, frame.state);
    frame.state.q_world_gyro = a.q_world_gyro.slerp(share, b.q_world_gyro);
    frame.state.p_world_m = (1.0 - share) * a.p_world_m + share * b.p_world_m;
    frame.state.v_world_m_s = (1.0 - share) * a.v_world_m_s + share * b.v_world_m_s;
    frame.covariance =
        (1.0 - share) * last->second.now->covariance + share * next->second.now->covariance;
  }
  return moved;
}

}  // namespace camgyro
