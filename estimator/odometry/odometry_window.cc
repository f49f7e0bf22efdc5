#include "estimator/odometry/odometry_window.h"

#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>
#include <glog/logging.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linear_algebra.h"
#include "core/so3.h"
#include "core/time.h"
#include "estimator/odometry/pixel_noise.h"
#include "estimator/odometry/window_program.h"
#include "factors/bias_walk.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kMinParallaxRad = 0.01;
// Of a direction from a point that is triangulated with states as they were predicted.
constexpr double kMaxTriangulationErrorRad = 0.02;
// A track that is seen so often and from so different directions, far beyond the error above, and
// still is of no point, contradicts the motion.
constexpr size_t kLeastLinesToContradict = 3;
constexpr double kContradictionParallaxRad = 0.05;
constexpr double kOutlierSigmas = 4.0;
constexpr double kLeastNoisePx = 1e-3;
// Of each solve's estimate of the noise in what later sightings are weighted with.
constexpr double kNoiseUpdate = 0.2;
constexpr size_t kMinResidualsForNoise = 30;
constexpr double kRecentreM = 5.0;
// Of yaw [rad] and position [m] of the first keyframe, which are the frame of all others: far below
// anything that pictures tell.
constexpr double kFrameSigma = 1e-5;
// Of what is taken as exactly known: f, c [px], t_r, t_d [s], b_g [rad/s], q_c [rad]; far below
// anything that matters.
StateVector LeastSigma() {
  StateVector least;
  least << 1e-2, 1e-2, 1e-2, 1e-6, 1e-6, Vector3d::Constant(1e-7), Vector3d::Constant(1e-6);
  return least;
}

// Counts a homogeneous point from an origin that has moved; returns the derivative of its tangent's
// coordinates.
Matrix3d MoveOrigin(const Vector3d& shift_m, VectorXd* point) {
  const ceres::SphereManifold<4> sphere;
  Eigen::Matrix4d move = Eigen::Matrix4d::Identity();
  move.topRightCorner<3, 1>() = -shift_m;
  Eigen::Matrix<double, 4, 3, Eigen::RowMajor> from;
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> to;
  sphere.PlusJacobian(point->data(), from.data());
  *point = move * *point;
  const double length = point->norm();
  *point /= length;
  sphere.MinusJacobian(point->data(), to.data());
  return to * move * from / length;
}

}  // namespace

OdometryWindow::OdometryWindow(const Calibration& calibration, const OdometryWindowOptions& options)
    : options_(options), q_gyro_cam_(calibration.q_gyro_cam) {}

OdometryWindow::~OdometryWindow() = default;

void OdometryWindow::SetPrior(std::vector<PriorBlock> blocks, const SquareRoot& root) {
  std::vector<MarginalPrior::Block> linearised;
  for (const PriorBlock& block : blocks) {
    linearised.push_back({Eigen::Map<VectorXd>(block.values, block.size), block.kind});
  }
  prior_ = std::make_unique<MarginalPrior>(std::move(linearised), root.S, root.r);
  prior_blocks_ = std::move(blocks);
}

void OdometryWindow::AddFirst(NewKeyframe keyframe, const WindowPrior& prior) {
  CHECK(keyframes_.empty());
  origin_m_ = keyframe.state.p_world_m;
  arm_ = prior.p_gyro_cam_m;
  OdometryNode& first = keyframes_.emplace_back();
  first.frame_stamp_ns = keyframe.frame_stamp_ns;
  first.time_ns = keyframe.time_ns;
  first.frame_number = keyframe.frame_number;
  first.state = keyframe.state;
  first.state.p_world_m.setZero();

  // Columns: q, p, b_g, b_a, calibration, p_gyro_cam; rows: yaw and p, then as the columns.
  MatrixXd S = MatrixXd::Zero(4 + 6 + kStateSize + 3, 12 + kStateSize + 3);
  Eigen::Matrix<double, 4, 6> yaw_position = Eigen::Matrix<double, 4, 6>::Zero();
  yaw_position.block<1, 3>(0, 0) = first.state.q_world_gyro.toRotationMatrix().row(2);
  yaw_position.block<3, 3>(1, 3).setIdentity();
  S.topLeftCorner<4, 6>() = yaw_position / kFrameSigma;
  S.block<3, 3>(4, 6) = prior.bias_gyro_sigma_rad_s.cwiseInverse().asDiagonal();
  S.block<3, 3>(7, 9) = Matrix3d::Identity() / prior.bias_accel_sigma_m_s2;
  StateCovariance calibration = prior.calibration_covariance;
  calibration.middleRows<3>(kStateBias).setZero();
  calibration.middleCols<3>(kStateBias).setZero();
  calibration.diagonal() += LeastSigma().cwiseAbs2();
  S.block<kStateSize, kStateSize>(10, 12) = InverseRoot(calibration);
  S.bottomRightCorner<3, 3>() = Matrix3d::Identity() / prior.p_gyro_cam_sigma_m;
  VectorXd r = VectorXd::Zero(S.rows());
  r.segment<3>(7) = first.state.bias_accel_m_s2 / prior.bias_accel_sigma_m_s2;
  SetPrior({{first.q(), 4, MarginalPrior::Kind::kRotation},
            {first.p()},
            {first.bias_gyro()},
            {first.bias_accel()},
            {calibration_.data(), kStateSize},
            {arm_.data()}},
           {std::move(S), std::move(r)});
  AddSightings(&keyframe);
}

void OdometryWindow::Add(NewKeyframe keyframe) {
  CHECK(!keyframes_.empty() && keyframe.link.has_value());
  const double span_s = SecondsSince(keyframes_.back().time_ns, keyframe.time_ns);
  OdometryNode& added = keyframes_.emplace_back();
  added.frame_stamp_ns = keyframe.frame_stamp_ns;
  added.time_ns = keyframe.time_ns;
  added.frame_number = keyframe.frame_number;
  added.state = keyframe.state;
  added.state.p_world_m -= origin_m_;
  added.inertial = MakePreintegrationWithBias(*keyframe.link);
  added.gyro_walk = std::make_unique<BiasWalk>(options_.walk.gyro_rad_s2_rtHz, span_s);
  added.accel_walk = std::make_unique<BiasWalk>(options_.walk.accel_m_s3_rtHz, span_s);
  AddSightings(&keyframe);
}

void OdometryWindow::AddSightings(NewKeyframe* keyframe) {
  for (LandmarkSighting& seen : keyframe->sightings) {
    OdometrySighting sighting;
    sighting.keyframe = &keyframes_.back();
    sighting.factor = MakeRowProjection(seen.projection);
    sighting.measurement = std::move(seen.projection);
    landmarks_[seen.track_id].sightings.push_back(std::move(sighting));
  }
}

void OdometryWindow::RemoveNewest() {
  CHECK_GT(keyframes_.size(), 1u);
  const OdometryNode* newest = &keyframes_.back();
  for (auto it = landmarks_.begin(); it != landmarks_.end();) {
    std::vector<OdometrySighting>& sightings = it->second.sightings;
    if (!sightings.empty() && sightings.back().keyframe == newest) sightings.pop_back();
    const bool gone = sightings.empty() && !it->second.in_prior;
    it = gone ? landmarks_.erase(it) : std::next(it);
  }
  keyframes_.pop_back();
}

ViewingLine OdometryWindow::LineOf(const OdometrySighting& sighting) const {
  const NavigationState& s = sighting.keyframe->state;
  const RowProjectionMeasurement& m = sighting.measurement;
  const NavigationState row = Predict(s, m.node_to_row, options_.gravity_m_s2);
  const Eigen::Quaterniond q_gyro_cam =
      q_gyro_cam_ * Exp(Vector3d(calibration_.segment<3>(kStateRotation)));
  return {row.p_world_m + row.q_world_gyro * arm_,
          (row.q_world_gyro * (q_gyro_cam * m.ray.ray)).normalized()};
}

// Before the camera, where the projection can be evaluated at all.
bool OdometryWindow::Believable(const OdometryLandmark& landmark,
                                const OdometrySighting& sighting) const {
  const ViewingLine line = LineOf(sighting);
  const Vector3d seen = landmark.point.head<3>() - landmark.point[3] * line.centre_m;
  return seen.dot(line.direction) > 1e-3 * seen.norm() && seen.norm() > 1e-4;
}

void OdometryWindow::DropUnbelievable(OdometryLandmark* landmark) const {
  std::vector<OdometrySighting>& sightings = landmark->sightings;
  sightings.erase(
      std::remove_if(sightings.begin(), sightings.end(),
                     [&](const OdometrySighting& s) { return !Believable(*landmark, s); }),
      sightings.end());
}

void OdometryWindow::TriangulateNew() {
  untriangulable_ = 0;
  for (auto& [track_id, landmark] : landmarks_) {
    if (landmark.known()) {
      DropUnbelievable(&landmark);
      continue;
    }
    std::vector<ViewingLine> lines;
    for (const OdometrySighting& sighting : landmark.sightings) lines.push_back(LineOf(sighting));
    if (const auto point = Triangulate(lines, kMinParallaxRad, kMaxTriangulationErrorRad)) {
      landmark.point << *point, 1.0;
      landmark.point.normalize();
    } else if (lines.size() >= kLeastLinesToContradict &&
               landmark.sightings.back().keyframe == &keyframes_.back() &&
               Parallax(lines) > kContradictionParallaxRad) {
      ++untriangulable_;
    }
  }
}

Status OdometryWindow::Solve(int max_iterations) {
  Recentre();
  TriangulateNew();
  Program program(this);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-4;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // No ordering of our own: Ceres would sort its blocks by their addresses, and the result would
  // depend on those in its last digits.
  ceres::Solver::Summary summary;
  ceres::Solve(options, &program.problem(), &summary);
  if (!summary.IsSolutionUsable()) return CannotEstimate("the odometry's window has no solution");
  DropOutliersAndUpdateNoise(program);
  return {};
}

void OdometryWindow::DropOutliersAndUpdateNoise(const Program& program) {
  PixelNoise noise;
  int newest = 0, newest_inliers = 0, points = 0;
  for (auto& [track_id, landmark] : landmarks_) {
    if (!landmark.used()) continue;
    points += !landmark.in_prior;
    const auto& ids = program.SightingsOf(track_id);
    std::vector<OdometrySighting> kept;
    std::vector<Eigen::Vector2d> residuals_px;
    for (size_t i = 0; i < ids.size(); ++i) {
      OdometrySighting& sighting = landmark.sightings[i];
      Eigen::Vector2d residual;
      const bool evaluated = program.problem().EvaluateResidualBlock(
          ids[i], /*apply_loss_function=*/false, nullptr, residual.data(), nullptr);
      const bool inlier = evaluated && residual.norm() < kOutlierSigmas;
      if (evaluated) residuals_px.emplace_back(residual * sighting.measurement.sigma_px);
      if (sighting.keyframe == &keyframes_.back()) {
        ++newest;
        newest_inliers += inlier;
      }
      if (inlier) kept.push_back(std::move(sighting));
    }
    landmark.sightings = std::move(kept);
    noise.Add(residuals_px, options_.tracks_drift);
  }
  known_sightings_ = newest + untriangulable_;
  inlier_ratio_ =
      known_sightings_ > 0 ? static_cast<double>(newest_inliers) / known_sightings_ : 0.0;
  residual_correlation_ = noise.Correlation();
  if (noise.size() < kMinResidualsForNoise) return;
  // A landmark that only the window knows takes 3 of its residuals' degrees of freedom, or one
  // where only its steps are residuals; a keyframe about 6.
  last_noise_px_ = noise.SigmaPx((options_.tracks_drift ? 1.0 : 3.0) * points +
                                 6.0 * static_cast<double>(keyframes_.size()));
  noise_px_ =
      std::max(kLeastNoisePx, (1.0 - kNoiseUpdate) * noise_px_ + kNoiseUpdate * last_noise_px_);
}

// Moves the inner origin to the oldest keyframe once that is far from it.
void OdometryWindow::Recentre() {
  const Vector3d shift_m = keyframes_.front().state.p_world_m;
  if (shift_m.norm() < kRecentreM) return;
  origin_m_ += shift_m;
  for (auto& [track_id, landmark] : landmarks_) {
    if (!landmark.known()) continue;
    VectorXd point = landmark.point;
    MoveOrigin(shift_m, &point);
    landmark.point = point;
  }
  std::vector<MarginalPrior::Block> blocks = prior_->blocks();
  MatrixXd S = prior_->sqrt_information();
  Eigen::Index column = 0;
  for (size_t i = 0; i < blocks.size(); ++i) {
    const double* values = prior_blocks_[i].values;
    const bool position = std::any_of(keyframes_.begin(), keyframes_.end(),
                                      [&](OdometryNode& k) { return k.p() == values; });
    if (position) blocks[i].linearization -= shift_m;
    if (blocks[i].kind == MarginalPrior::Kind::kHomogeneousPoint) {
      S.middleCols<3>(column) *= MoveOrigin(shift_m, &blocks[i].linearization).inverse();
    }
    column += blocks[i].tangent_size();
  }
  prior_ = std::make_unique<MarginalPrior>(std::move(blocks), std::move(S), prior_->offset());
  for (OdometryNode& k : keyframes_) k.state.p_world_m -= shift_m;
}

WindowKeyframe OdometryWindow::keyframe(size_t i) const {
  const OdometryNode& k = keyframes_[i];
  WindowKeyframe result{k.frame_stamp_ns, k.time_ns, k.frame_number, k.state};
  result.state.p_world_m += origin_m_;
  return result;
}

bool OdometryWindow::IsMapped(int64_t track_id) const {
  const auto found = landmarks_.find(track_id);
  return found != landmarks_.end() && found->second.used();
}

std::vector<MappedPoint> OdometryWindow::Points() const {
  std::vector<MappedPoint> points;
  for (const auto& [track_id, landmark] : landmarks_) {
    if (!landmark.used() || !(landmark.point[3] > 1e-6)) continue;
    points.push_back({track_id, origin_m_ + landmark.point.head<3>() / landmark.point[3],
                      static_cast<int>(landmark.sightings.size())});
  }
  return points;
}

Result<OdometryWindow::Covariance> OdometryWindow::ComputeCovariance(bool of_all_keyframes) {
  Program program(this);
  ReducedInformation information;
  for (OdometryNode& k : keyframes_) Program::AddKeyframe(&k, &information);
  program.AddShared(&information);
  for (auto& [track_id, landmark] : landmarks_) {
    if (landmark.in_prior) information.AddBlock(landmark.point.data(), 3);
  }
  bool sound = information.Add(program.problem(), program.prior());
  for (size_t k = 1; k < keyframes_.size(); ++k) {
    for (const ceres::ResidualBlockId id : program.LinksOf(k)) {
      sound = sound && information.Add(program.problem(), id);
    }
  }
  for (auto& [track_id, landmark] : landmarks_) {
    if (!sound || !landmark.used()) continue;
    if (landmark.in_prior) {
      for (const ceres::ResidualBlockId id : program.SightingsOf(track_id)) {
        sound = sound && information.Add(program.problem(), id);
      }
      continue;
    }
    sound = information.AddWithout(program.problem(), program.SightingsOf(track_id),
                                   landmark.point.data(), 3);
  }
  const tl::unexpected<Error> failed =
      CannotEstimate("the odometry's window does not determine its state");
  if (!sound) return failed;
  const MatrixXd& H = information.All().H;
  const SymmetricSolver solver(H);
  if (!solver.positive_definite()) return failed;
  const auto block = [&](Eigen::Index first, Eigen::Index size) {
    MatrixXd columns = MatrixXd::Zero(H.rows(), size);
    columns.middleRows(first, size).setIdentity();
    return MatrixXd(solver.Solve(columns).middleRows(first, size));
  };
  Covariance result;
  const Eigen::Index shared = information.ColumnOf(calibration_.data());
  for (Eigen::Index first = 0; first < shared; first += kNavSize) {
    const bool wanted = of_all_keyframes || first == 0 || first + kNavSize == shared;
    if (wanted) result.states.emplace_back(block(first, kNavSize));
  }
  result.calibration = block(shared, kStateSize);
  result.p_gyro_cam = block(shared + kStateSize, 3);
  return result;
}

}  // namespace camgyro
