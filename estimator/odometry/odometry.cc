#include "estimator/odometry/odometry.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/format.h"
#include "core/robust_statistics.h"
#include "core/time.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

constexpr double kLeastKeyframeIntervalS = 0.06;
// Frames that hold fewer of the newest keyframe's tracks than this share become keyframes early.
constexpr double kLeastCommonShare = 0.6;
// Parallax below so many times the noise of a direction is none: the camera stands still, and the
// newest keyframe is replaced instead of joined, for at most so long.
constexpr double kStillNoises = 3.0;
constexpr double kLongestLinkS = 5.0;
constexpr int kIterations = 6;
// Beyond this the next start knows the motion better than dead reckoning does.
constexpr double kLostSpeedSigmaMS = 0.5;
// A window has gone wrong whose pictures contradict its motion in so many keyframes in a row.
constexpr double kLeastInlierRatio = 0.3;
constexpr int kLeastSightingsToJudge = 15;
constexpr int kMostContradictions = 3;
constexpr double kMostBiasAccelMS2 = 2.0;
constexpr double kRoundingS = 1e-6;

}  // namespace

Odometry::Odometry(const Calibration& calibration, const OdometryOptions& options)
    : calibration_(calibration),
      options_(options),
      reach_s_(0.5 * std::abs(calibration.readout_s) + kRoundingS),
      last_gyro_ns_(INT64_MIN),
      last_accel_ns_(INT64_MIN),
      last_frame_ns_(INT64_MIN),
      next_try_ns_(INT64_MIN),
      refined_(calibration),
      p_gyro_cam_m_(options.p_gyro_cam_m),
      p_gyro_cam_sigma_m_(Vector3d::Constant(options.p_gyro_cam_sigma_m)) {}

Odometry::~Odometry() = default;

Status Odometry::AddGyro(const GyroSample& sample) {
  if (!sample.omega_gyro_rad_s.allFinite()) return BadInput("odometry: a rate is not finite");
  if (sample.stamp_ns <= last_gyro_ns_) return BadInput("odometry: a gyro stamp does not increase");
  last_gyro_ns_ = sample.stamp_ns;
  gyro_.push_back(sample);
  Advance();
  return {};
}

Status Odometry::AddAccel(const AccelSample& sample) {
  if (!sample.accel_gyro_m_s2.allFinite()) {
    return BadInput("odometry: an acceleration is not finite");
  }
  if (sample.stamp_ns <= last_accel_ns_) {
    return BadInput("odometry: an accelerometer stamp does not increase");
  }
  last_accel_ns_ = sample.stamp_ns;
  accel_.push_back(sample);
  Advance();
  return {};
}

Status Odometry::AddFrame(int64_t stamp_ns, std::vector<TrackedPoint> tracks) {
  for (const TrackedPoint& point : tracks) {
    if (!point.px.allFinite()) return BadInput("odometry: a tracked pixel is not finite");
  }
  if (stamp_ns <= last_frame_ns_) return BadInput("odometry: a frame stamp does not increase");
  last_frame_ns_ = stamp_ns;
  const double to_middle_row_s = calibration_.delay_s + 0.5 * calibration_.readout_s;
  pending_.push_back({stamp_ns, StampAt(stamp_ns, to_middle_row_s), frames_++, std::move(tracks)});
  Advance();
  return {};
}

void Odometry::Advance() {
  while (!pending_.empty()) {
    const int64_t end_ns = StampAt(pending_.front().time_ns, reach_s_);
    if (std::min(last_gyro_ns_, last_accel_ns_) < end_ns) return;
    QueuedFrame frame = std::move(pending_.front());
    pending_.pop_front();
    const int64_t begin_ns = StampAt(frame.time_ns, -reach_s_);
    // Frames from before the inertial data are nobody's.
    if (gyro_.front().stamp_ns <= begin_ns && accel_.front().stamp_ns <= begin_ns) {
      Process(std::move(frame));
    }
    ForgetInertial();
  }
}

void Odometry::Process(QueuedFrame frame) {
  if (window_) {
    Track(frame);
    if (window_) return;
  }
  starting_.push_back(std::move(frame));
  TryStart();
}

// The motion since the newest keyframe; a new one, if it is time.
void Odometry::Track(const QueuedFrame& frame) {
  const WindowKeyframe newest = window_->newest();
  const auto imu = IntegralOver(newest.time_ns, frame.time_ns, newest.state);
  if (!imu) return Lose(frame.time_ns, "the inertial samples have a hole");
  const double span_s = SecondsSince(newest.time_ns, frame.time_ns);
  const ImuDelta delta = imu->Between(0.0, span_s);
  OdometryPose pose;
  pose.frame_stamp_ns = frame.stamp_ns;
  pose.time_ns = frame.time_ns;
  pose.segment = segment_;
  pose.state = Predict(newest.state, delta, options_.gravity_m_s2);
  pose.covariance = PredictCovariance(newest.state, newest_covariance_, delta,
                                      imu->Covariance(0.0, span_s, options_.noise), options_.walk);
  const double speed_variance =
      pose.covariance.block<3, 3>(kNavVelocity, kNavVelocity).diagonal().maxCoeff();
  if (!(speed_variance < kLostSpeedSigmaMS * kLostSpeedSigmaMS)) {
    return Lose(frame.time_ns, Format("the speed is known to %.1f m/s only",
                                      std::sqrt(std::max(0.0, speed_variance))));
  }
  std::vector<double> parallax_rad;
  const std::vector<LandmarkSighting> sightings = SightingsOf(frame, *imu, newest.time_ns);
  for (const LandmarkSighting& seen : sightings) {
    pose.mapped_tracks += window_->IsMapped(seen.track_id);
    const auto before = newest_directions_.find(seen.track_id);
    if (before == newest_directions_.end()) continue;
    const RowProjectionMeasurement& m = seen.projection;
    const Vector3d now =
        delta.q_i_j * (m.node_to_row.q_i_j * (m.q_gyro_cam * m.ray.ray)).normalized();
    parallax_rad.push_back(std::atan2(now.cross(before->second).norm(), now.dot(before->second)));
  }
  const bool many_lost = static_cast<double>(parallax_rad.size()) <
                         kLeastCommonShare * static_cast<double>(newest_directions_.size());
  const double parallax = MedianOr(parallax_rad, 0.0);
  const bool keyframe = span_s >= options_.keyframe_interval_s - 1e-3 ||
                        (span_s >= kLeastKeyframeIntervalS &&
                         (many_lost || parallax > options_.keyframe_parallax_rad));
  if (keyframe) {
    if (Status added = AddKeyframe(frame, parallax); !added) {
      return Lose(frame.time_ns, added.error().message, /*contradicted=*/true);
    }
    pose.state = window_->newest().state;
    pose.covariance = newest_covariance_;
  }
  pose.covariance = InWorld(pose.state, pose.covariance);
  poses_.push_back(pose);
}

Status Odometry::AddKeyframe(const QueuedFrame& frame, double parallax_rad) {
  const WindowKeyframe newest = window_->newest();
  // Of a track that drifts, after so many frames, the noise is that of its steps together; it is
  // halved here, since that of two independent sightings is meant.
  const auto steps = static_cast<double>(frame.number - newest.frame_number);
  const double noises = tracks_drift_ ? std::sqrt(0.5 * steps) : 1.0;
  const double still_rad = kStillNoises * noises * window_->noise_px() / calibration_.lens[kFocal];
  WindowKeyframe from = newest;
  bool replace = false;
  if (window_->size() > 2 && parallax_rad < still_rad && newest_parallax_rad_ < still_rad) {
    from = window_->keyframe(window_->size() - 2);
    replace = SecondsSince(from.time_ns, frame.time_ns) < kLongestLinkS;
    if (!replace) from = newest;
  }
  const auto imu = IntegralOver(from.time_ns, frame.time_ns, from.state);
  if (!imu) return CannotEstimate("the inertial samples have a hole");
  const double span_s = SecondsSince(from.time_ns, frame.time_ns);
  NewKeyframe added;
  added.frame_stamp_ns = frame.stamp_ns;
  added.time_ns = frame.time_ns;
  added.frame_number = frame.number;
  added.state = Predict(from.state, imu->Between(0.0, span_s), options_.gravity_m_s2);
  added.link = Link(*imu, from.time_ns, from.time_ns, frame.time_ns, from.state);
  added.sightings = SightingsOf(frame, *imu, from.time_ns);
  if (replace) window_->RemoveNewest();
  newest_parallax_rad_ = parallax_rad;
  SetNewestDirections(added.sightings);
  window_->Add(std::move(added));
  if (Status solved = window_->Solve(kIterations); !solved) return solved;
  return AfterSolve();
}

// Covariances, doubts, and what there is too much of in the window.
Status Odometry::AfterSolve() {
  NavigationCovariance newest = NavigationCovariance::Zero();
  for (bool first = true;; first = false) {
    const Result<OdometryWindow::Covariance> covariance = window_->ComputeCovariance(false);
    if (!covariance) return tl::unexpected(covariance.error());
    if (first) {
      newest = covariance->states.back();
      refined_ = Moved(calibration_, window_->calibration_deviation());
      refined_.covariance = covariance->calibration;
      refined_.total_covariance.reset();  // the prior had it
      p_gyro_cam_m_ = window_->p_gyro_cam_m();
      p_gyro_cam_sigma_m_ = covariance->p_gyro_cam.diagonal().cwiseSqrt();
      noise_px_ = window_->noise_px();
    }
    if (window_->size() <= static_cast<size_t>(options_.keyframes)) break;
    const Result<WindowKeyframe> left = window_->MarginaliseOldest();
    if (!left) return tl::unexpected(left.error());
    Leave(*left, covariance->states.front());
    if (window_->size() <= static_cast<size_t>(options_.keyframes)) break;
  }
  newest_covariance_ = newest;
  const NavigationState& state = window_->newest().state;
  if (state.bias_accel_m_s2.norm() > kMostBiasAccelMS2) {
    return CannotEstimate(
        Format("an accelerometer bias of %.1f m/s^2 cannot be", state.bias_accel_m_s2.norm()));
  }
  const bool contradicts = window_->known_sightings() >= kLeastSightingsToJudge &&
                           window_->inlier_ratio() < kLeastInlierRatio;
  contradictions_ = contradicts ? contradictions_ + 1 : 0;
  if (contradictions_ >= kMostContradictions) {
    return CannotEstimate(Format("only %.0f %% of the points seen agree with the motion",
                                 100.0 * window_->inlier_ratio()));
  }
  return {};
}

void Odometry::SetNewestDirections(const std::vector<LandmarkSighting>& sightings) {
  newest_directions_.clear();
  for (const LandmarkSighting& seen : sightings) {
    const RowProjectionMeasurement& m = seen.projection;
    newest_directions_[seen.track_id] =
        (m.node_to_row.q_i_j * (m.q_gyro_cam * m.ray.ray)).normalized();
  }
}

// With what is not known of where the segment began: it moves and turns all of the segment alike.
NavigationCovariance Odometry::InWorld(const NavigationState& state,
                                       const NavigationCovariance& covariance) const {
  Eigen::Matrix<double, kNavSize, 4> J = Eigen::Matrix<double, kNavSize, 4>::Zero();
  const Vector3d up = Vector3d::UnitZ();
  J.block<3, 1>(kNavRotation, 0) = state.q_world_gyro.conjugate() * up;
  J.block<3, 1>(kNavPosition, 0) = up.cross(state.p_world_m - segment_begin_m_);
  J.block<3, 1>(kNavVelocity, 0) = up.cross(state.v_world_m_s);
  J.block<3, 3>(kNavPosition, 1).setIdentity();
  return covariance + J * segment_covariance_ * J.transpose();
}

void Odometry::Leave(const WindowKeyframe& keyframe, const NavigationCovariance& covariance) {
  OdometryPose pose;
  pose.frame_stamp_ns = keyframe.frame_stamp_ns;
  pose.time_ns = keyframe.time_ns;
  pose.segment = segment_;
  pose.state = keyframe.state;
  pose.covariance = InWorld(keyframe.state, covariance);
  keyframes_.push_back(pose);
}

void Odometry::LeaveAll() {
  const Result<OdometryWindow::Covariance> covariance = window_->ComputeCovariance(true);
  if (!covariance) return;  // of a window that has gone wrong nothing is told
  for (size_t i = 0; i < window_->size(); ++i) {
    Leave(window_->keyframe(i), covariance->states[i]);
  }
}

void Odometry::Lose(int64_t time_ns, const std::string& why, bool contradicted) {
  const WindowKeyframe newest = window_->newest();
  anchor_ = Anchor{newest.time_ns, newest.state, InWorld(newest.state, newest_covariance_),
                   !contradicted};
  LeaveAll();
  window_.reset();
  events_.push_back({OdometryEvent::Kind::kLost, time_ns, segment_, why});
  starting_.clear();
  next_try_ns_ = INT64_MIN;
  contradictions_ = 0;
  newest_parallax_rad_ = 0.0;
  start_explanation_ = "lost: " + why;
}

void Odometry::Finish() {
  pending_.clear();
  if (!window_) return;
  LeaveAll();
  window_.reset();
}

std::vector<OdometryPose> Odometry::TakePoses() { return std::exchange(poses_, {}); }
std::vector<OdometryPose> Odometry::TakeKeyframes() { return std::exchange(keyframes_, {}); }
std::vector<OdometryEvent> Odometry::TakeEvents() { return std::exchange(events_, {}); }
std::vector<MappedPoint> Odometry::Points() const {
  return window_ ? window_->Points() : std::vector<MappedPoint>();
}

}  // namespace camgyro
