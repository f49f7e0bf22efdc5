#include "estimator/vins/vins_refinement.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/covariance.h>
#include <ceres/loss_function.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "core/linear_algebra.h"
#include "core/robust_statistics.h"
#include "core/time.h"
#include "factors/preintegration.h"
#include "factors/rotation_manifold.h"
#include "factors/row_projection.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kRefinementRounds = 3;
constexpr double kOutlierSigmas = 4.0;
constexpr double kCauchySigmas = 2.0;
constexpr int kMinUsedSightings = 2;
constexpr double kMaxNoiseFactor = 1e3;

struct Node {
  std::array<double, 4> q{};  // [x y z w]
  std::array<double, 3> p{}, v{};
};

class Problem {
 public:
  Problem(const VinsWindow& window, const VinsOptions& options)
      : window_(window), options_(options) {
    ceres::Problem::Options problem_options;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options_ = problem_options;
  }

  void SetStart(const VinsStructure& structure, const VinsAlignment& alignment) {
    nodes_.resize(window_.keyframes.size());
    for (size_t k = 0; k < nodes_.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      Eigen::Map<Eigen::Quaterniond>(nodes_[k].q.data()) = window_.keyframes[k].q_world_gyro;
      Eigen::Map<Vector3d>(nodes_[k].p.data()) = alignment.p_world_m.col(column);
      Eigen::Map<Vector3d>(nodes_[k].v.data()) = alignment.v_world_m_s.col(column);
    }
    gravity_ = alignment.gravity_world.normalized();
    bias_accel_ = alignment.bias_accel_m_s2;
    arm_ = options_.p_gyro_cam_m;
    points_.resize(window_.track_ids.size());
    active_.assign(window_.observations.size(), false);
    for (size_t i = 0; i < window_.observations.size(); ++i) {
      const auto landmark = static_cast<size_t>(window_.observations[i].landmark);
      if (!structure.points[landmark]) continue;
      active_[i] = true;
      // The structure's origin is the first camera; the world's is the first gyro frame.
      points_[landmark] << alignment.scale * *structure.points[landmark] + arm_, 1.0;
      points_[landmark].normalize();
    }
    DropPointsBehind();
  }

  // Solves; then estimates the noise from the residuals, and drops outliers unless it is the last
  // round.
  Status Solve(bool last) {
    Build();
    ceres::Solver::Options options;
    options.linear_solver_type = nodes_.size() > 40 ? ceres::SPARSE_SCHUR : ceres::DENSE_SCHUR;
    // Before the last round only noise and outliers are wanted.
    options.max_num_iterations = last ? 30 : 10;
    options.function_tolerance = last ? 1e-7 : 1e-4;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    std::vector<double*> blocks;
    problem_->GetParameterBlocks(&blocks);
    for (double* block : blocks) options.linear_solver_ordering->AddElementToGroup(block, 1);
    for (const size_t j : used_landmarks_) {
      options.linear_solver_ordering->AddElementToGroup(points_[j].data(), 0);
    }
    ceres::Solver::Summary summary;
    ceres::Solve(options, problem_.get(), &summary);
    if (!summary.IsSolutionUsable()) return CannotEstimate("the joint refinement failed");
    UpdateNoise();
    if (!last) DropOutliers();
    if (static_cast<int>(used_landmarks_.size()) < 8) {
      return CannotEstimate("too few landmarks were left in the joint refinement");
    }
    return {};
  }

  Status Report(VinsStart* start) {
    FillValues(start);
    return FillCovariance(start);
  }

 private:
  bool Behind(size_t i) const {
    const VinsObservation& seen = window_.observations[i];
    const Eigen::Vector4d& point = points_[static_cast<size_t>(seen.landmark)];
    const Eigen::Map<const Vector3d> p(nodes_[static_cast<size_t>(seen.keyframe)].p.data());
    return (point.head<3>() - point[3] * p).dot(seen.direction_world) <= 1e-4;
  }

  void DropPointsBehind() {
    for (size_t i = 0; i < active_.size(); ++i) {
      if (active_[i] && Behind(i)) active_[i] = false;
    }
  }

  void Build() {
    problem_ = std::make_unique<ceres::Problem>(problem_options_);
    residual_ids_.assign(active_.size(), nullptr);
    for (Node& node : nodes_) {
      problem_->AddParameterBlock(node.q.data(), 4, &rotation_manifold_);
      problem_->AddParameterBlock(node.p.data(), 3);
      problem_->AddParameterBlock(node.v.data(), 3);
    }
    problem_->SetParameterBlockConstant(nodes_[0].q.data());
    problem_->SetParameterBlockConstant(nodes_[0].p.data());
    problem_->AddParameterBlock(gravity_.data(), 3, &direction_manifold_);

    std::vector<int> sightings(points_.size(), 0);
    for (size_t i = 0; i < active_.size(); ++i) {
      if (active_[i]) ++sightings[static_cast<size_t>(window_.observations[i].landmark)];
    }
    used_landmarks_.clear();
    for (size_t j = 0; j < points_.size(); ++j) {
      if (sightings[j] < kMinUsedSightings) continue;
      used_landmarks_.push_back(j);
      problem_->AddParameterBlock(points_[j].data(), 4, &point_manifold_);
    }
    for (size_t i = 0; i < active_.size(); ++i) {
      const VinsObservation& seen = window_.observations[i];
      if (!active_[i] || sightings[static_cast<size_t>(seen.landmark)] < kMinUsedSightings)
        continue;
      const auto k = static_cast<size_t>(seen.keyframe);
      RowProjectionMeasurement m;
      m.node_to_row = window_.imu.Between(window_.keyframes[k].time_s, seen.time_s);
      m.omega_gyro_rad_s = window_.imu.RateAt(seen.time_s);
      m.row_fraction = seen.px.y() / window_.calibration.height_px;
      m.q_gyro_cam = window_.calibration.q_gyro_cam;
      m.ray = seen.ray;
      m.sigma_px = noise_px_;
      m.gravity_m_s2 = options_.gravity_m_s2;
      residual_ids_[i] = problem_->AddResidualBlock(
          MakeRowProjection(m).release(), &loss_, nodes_[k].q.data(), nodes_[k].p.data(),
          nodes_[k].v.data(), gravity_.data(), arm_.data(), calibration_.data(),
          points_[static_cast<size_t>(seen.landmark)].data());
    }
    AddInertial();
    AddPriors();
  }

  void AddInertial() {
    inertial_ids_.clear();
    ImuNoise noise = options_.noise;
    noise.accel_m_s2_rtHz *= accel_noise_factor_;
    for (size_t k = 0; k + 1 < nodes_.size(); ++k) {
      const double from_s = window_.keyframes[k].time_s, to_s = window_.keyframes[k + 1].time_s;
      PreintegrationMeasurement m;
      m.delta = window_.imu.Between(from_s, to_s);
      m.covariance = window_.imu.Covariance(from_s, to_s, noise);
      m.gravity_m_s2 = options_.gravity_m_s2;
      Node &i = nodes_[k], &j = nodes_[k + 1];
      inertial_ids_.push_back(problem_->AddResidualBlock(
          MakePreintegration(m).release(), nullptr, i.q.data(), i.p.data(), i.v.data(), j.q.data(),
          j.p.data(), j.v.data(), gravity_.data(), bias_accel_.data(), calibration_.data()));
    }
  }

  void AddPriors() {
    // What the calibration holds for exactly known still gets a sigma, far below anything that
    // matters: f, c [px], t_r, t_d [s], b_g [rad/s], q_c [rad].
    StateVector least;
    least << 1e-2, 1e-2, 1e-2, 1e-6, 1e-6, Vector3d::Constant(1e-6), Vector3d::Constant(1e-6);
    const Calibration& given = window_.calibration;
    StateCovariance covariance = given.total_covariance.value_or(given.covariance);
    covariance.diagonal() += least.cwiseAbs2();
    problem_->AddResidualBlock(
        new ceres::NormalPrior(InverseRoot(covariance), Eigen::VectorXd::Zero(kStateSize)), nullptr,
        calibration_.data());
    problem_->AddResidualBlock(
        new ceres::NormalPrior(Matrix3d::Identity() / options_.accel_bias_sigma_m_s2,
                               Vector3d::Zero()),
        nullptr, bias_accel_.data());
    problem_->AddResidualBlock(
        new ceres::NormalPrior(Matrix3d::Identity() / options_.p_gyro_cam_sigma_m,
                               options_.p_gyro_cam_m),
        nullptr, arm_.data());
  }

  Eigen::VectorXd Residual(ceres::ResidualBlockId id, int size) const {
    Eigen::VectorXd residual(size);
    if (!problem_->EvaluateResidualBlock(id, /*apply_loss_function=*/false, nullptr,
                                         residual.data(), nullptr)) {
      residual.setConstant(std::nan(""));
    }
    return residual;
  }

  void UpdateNoise() {
    std::vector<double> norms;
    whitened_.assign(active_.size(), std::nan(""));
    for (size_t i = 0; i < active_.size(); ++i) {
      if (residual_ids_[i] == nullptr) continue;
      whitened_[i] = Residual(residual_ids_[i], 2).norm();
      if (std::isfinite(whitened_[i])) norms.push_back(whitened_[i]);
    }
    if (norms.empty()) return;
    // A landmark takes 3 of its residuals' degrees of freedom, a keyframe about 6.
    const double all = 2.0 * static_cast<double>(norms.size());
    const double taken = 3.0 * static_cast<double>(used_landmarks_.size()) +
                         6.0 * static_cast<double>(nodes_.size());
    const double relative =
        MedianInPlace(&norms) / 1.177 / std::sqrt(std::max(0.1, 1 - taken / all));
    for (double& norm : whitened_) norm /= relative;
    noise_px_ = std::max(1e-3, noise_px_ * relative);

    // The accelerometer's share: velocities and positions. Each keyframe's velocity takes 3 of
    // the 6 residuals that it brings.
    double sum = 0.0;
    for (const ceres::ResidualBlockId id : inertial_ids_) {
      sum += Residual(id, 9).tail<6>().squaredNorm();
    }
    const double per_degree = sum / (3.0 * static_cast<double>(inertial_ids_.size()));
    accel_noise_factor_ =
        std::clamp(accel_noise_factor_ * std::sqrt(per_degree), 1.0, kMaxNoiseFactor);
  }

  void DropOutliers() {
    for (size_t i = 0; i < active_.size(); ++i) {
      if (residual_ids_[i] != nullptr && !(whitened_[i] < kOutlierSigmas)) active_[i] = false;
    }
    DropPointsBehind();
  }

  void FillValues(VinsStart* start) const {
    start->states.clear();
    for (size_t k = 0; k < nodes_.size(); ++k) {
      VinsState state;
      state.time_ns = StampAt(window_.origin_ns, window_.keyframes[k].time_s);
      state.q_world_gyro = Eigen::Map<const Eigen::Quaterniond>(nodes_[k].q.data());
      state.p_world_m = Eigen::Map<const Vector3d>(nodes_[k].p.data());
      state.v_world_m_s = Eigen::Map<const Vector3d>(nodes_[k].v.data());
      start->states.push_back(state);
    }
    start->gravity_world_m_s2 = options_.gravity_m_s2 * gravity_;
    start->bias_accel_m_s2 = bias_accel_;
    start->p_gyro_cam_m = arm_;
    Calibration& c = start->calibration;
    c = Moved(window_.calibration, calibration_);
    c.q_gyro_cam.normalize();
    start->noise_px = noise_px_;
    start->accel_noise_factor = accel_noise_factor_;
    start->observations = static_cast<int>(
        std::count_if(residual_ids_.begin(), residual_ids_.end(), [](auto id) { return id; }));
  }

  Status FillCovariance(VinsStart* start) {
    // Ceres' covariance does not ask whether its Jacobian could be evaluated.
    double cost = 0.0;
    if (!problem_->Evaluate({}, &cost, nullptr, nullptr, nullptr) || !std::isfinite(cost)) {
      return CannotEstimate("the joint refinement ended where it cannot be evaluated");
    }
    // The first pose is the world; the others in the order of VinsStart::covariance.
    std::vector<const double*> blocks;
    for (size_t k = 0; k < nodes_.size(); ++k) {
      if (k > 0) {
        blocks.push_back(nodes_[k].q.data());
        blocks.push_back(nodes_[k].p.data());
      }
      blocks.push_back(nodes_[k].v.data());
    }
    for (const double* block : {gravity_.data(), bias_accel_.data(), arm_.data()}) {
      blocks.push_back(block);
    }
    blocks.push_back(calibration_.data());

    std::vector<std::pair<const double*, const double*>> pairs;
    for (size_t a = 0; a < blocks.size(); ++a) {
      for (size_t b = a; b < blocks.size(); ++b) pairs.emplace_back(blocks[a], blocks[b]);
    }
    for (const size_t j : used_landmarks_) pairs.emplace_back(points_[j].data(), points_[j].data());
    ceres::Covariance::Options options;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    const auto n = static_cast<Eigen::Index>(9 * nodes_.size() + 3 + 3 + 3 + kStateSize);
    const Eigen::Index tangent = n - 7;  // without the first pose, and 2 of gravity's 3
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joint(tangent, tangent);
    if (!covariance.Compute(pairs, problem_.get()) ||
        !covariance.GetCovarianceMatrixInTangentSpace(blocks, joint.data())) {
      return CannotEstimate("the window does not determine its states");
    }
    // From the tangent of Ceres' sphere to gravity as a vector.
    Eigen::MatrixXd expand = Eigen::MatrixXd::Zero(n, tangent);
    const Eigen::Index gravity_row = n - 9 - kStateSize;
    expand.block(6, 0, gravity_row - 6, gravity_row - 6).setIdentity();
    Eigen::Matrix<double, 3, 2, Eigen::RowMajor> sphere;
    direction_manifold_.PlusJacobian(gravity_.data(), sphere.data());
    expand.block<3, 2>(gravity_row, gravity_row - 6) = options_.gravity_m_s2 * sphere;
    expand.bottomRightCorner(6 + kStateSize, 6 + kStateSize).setIdentity();
    start->covariance = expand * joint * expand.transpose();
    start->calibration.covariance = start->covariance.bottomRightCorner<kStateSize, kStateSize>();
    start->calibration.total_covariance.reset();  // the prior had it

    start->landmarks.clear();
    for (const size_t j : used_landmarks_) {
      VinsLandmark landmark;
      landmark.track_id = window_.track_ids[j];
      landmark.point = points_[j];
      for (size_t i = 0; i < residual_ids_.size(); ++i) {
        landmark.observations += residual_ids_[i] != nullptr &&
                                 static_cast<size_t>(window_.observations[i].landmark) == j;
      }
      Eigen::Matrix<double, 4, 4, Eigen::RowMajor> ambient;
      covariance.GetCovarianceBlock(points_[j].data(), points_[j].data(), ambient.data());
      const double w = std::max(1e-6, points_[j][3]);
      Eigen::Matrix<double, 3, 4> J;
      J << Matrix3d::Identity() / w, -points_[j].head<3>() / (w * w);
      landmark.covariance_m2 = J * ambient * J.transpose();
      start->landmarks.push_back(landmark);
    }
    return {};
  }

  const VinsWindow& window_;
  const VinsOptions& options_;
  ceres::Problem::Options problem_options_;
  RotationManifold rotation_manifold_;
  ceres::SphereManifold<3> direction_manifold_;
  ceres::SphereManifold<4> point_manifold_;
  ceres::CauchyLoss loss_{kCauchySigmas};

  std::vector<Node> nodes_;
  Vector3d gravity_ = Vector3d::UnitZ(), bias_accel_ = Vector3d::Zero(), arm_ = Vector3d::Zero();
  StateVector calibration_ = StateVector::Zero();  // deviation from the input's
  std::vector<Eigen::Vector4d, Eigen::aligned_allocator<Eigen::Vector4d>> points_;
  std::vector<bool> active_;
  double noise_px_ = 1.0;
  double accel_noise_factor_ = 1.0;

  // Of the latest solve.
  std::unique_ptr<ceres::Problem> problem_;
  std::vector<size_t> used_landmarks_;
  std::vector<ceres::ResidualBlockId> residual_ids_;  // per observation; null: not used
  std::vector<ceres::ResidualBlockId> inertial_ids_;
  std::vector<double> whitened_;
};

// Positions are known up to their scale about the first: its relative sigma is that of the
// positions' component along themselves.
double ScaleSigma(const VinsStart& start) {
  Eigen::VectorXd along = Eigen::VectorXd::Zero(start.covariance.rows());
  double size = 0.0;
  for (size_t k = 0; k < start.states.size(); ++k) {
    along.segment<3>(start.StateRow(k) + 3) = start.states[k].p_world_m;
    size += start.states[k].p_world_m.squaredNorm();
  }
  return std::sqrt(along.dot(start.covariance * along)) / std::max(1e-12, size);
}

}  // namespace

Status RefineVins(const VinsWindow& window, const VinsStructure& structure,
                  const VinsAlignment& alignment, const VinsOptions& options, VinsStart* start) {
  Problem problem(window, options);
  problem.SetStart(structure, alignment);
  for (int round = 0; round < kRefinementRounds; ++round) {
    if (Status solved = problem.Solve(round + 1 == kRefinementRounds); !solved) return solved;
  }
  if (Status reported = problem.Report(start); !reported) return reported;
  start->scale_sigma = ScaleSigma(*start);
  const Matrix3d gravity = start->covariance.block<3, 3>(start->GravityRow(), start->GravityRow());
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(gravity);
  start->gravity_sigma_rad = std::sqrt(eigen.eigenvalues()[2]) / options.gravity_m_s2;
  return {};
}

}  // namespace camgyro
