// How Odometry begins, and begins again.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/format.h"
#include "core/time.h"
#include "estimator/odometry/odometry.h"

namespace camgyro {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Stretches that a start is looked for in, the shortest first: short ones begin early, long ones
// determine the scale where the motion is weak.
constexpr std::array<double, 3> kStartSpansS = {2.0, 3.0, 4.0};
constexpr double kTryEveryS = 0.5;
constexpr int kFirstIterations = 20;
// What the gyro's bias at one time may be from its mean over a recording [rad/s].
constexpr double kBiasAtOneTimeRadS = 1e-3;
// Residuals of neighbouring sightings that correlate by more than this are of tracks that drift. On
// simulated walks it is -0.10 to -0.26 where noise is independent, and 0.32 and more where it adds
// up (docs/lab/odometry.md).
constexpr double kDriftCorrelation = 0.15;
constexpr double kUnknownPlaceM = 1e3;

// Turn about the world's z that takes orientation b as near as possible to a [rad].
double YawBetween(const Quaterniond& a, const Quaterniond& b) {
  const Eigen::Matrix3d R = (a * b.conjugate()).toRotationMatrix();
  return std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
}

// The shortest rotation that turns this gravity down the world's z; about any level axis where it
// points up. (Quaternion::FromTwoVectors is an SVD, whose templates take GCC long.)
Quaterniond ShortestToLevel(const Vector3d& gravity) {
  const Vector3d from = gravity.normalized(), down = -Vector3d::UnitZ();
  const Vector3d middle = from + down;
  if (middle.squaredNorm() < 1e-16) return {0.0, 1.0, 0.0, 0.0};
  const Vector3d axis = from.cross(middle.normalized());
  return {from.dot(middle.normalized()), axis.x(), axis.y(), axis.z()};
}

}  // namespace

void Odometry::TryStart() {
  const int64_t now_ns = starting_.back().stamp_ns;
  while (SecondsSince(starting_.front().stamp_ns, now_ns) > kStartSpansS.back() + 0.1) {
    starting_.pop_front();
  }
  if (now_ns < next_try_ns_) return;
  next_try_ns_ = StampAt(now_ns, kTryEveryS);
  VinsOptions options;
  options.noise = options_.noise;
  options.p_gyro_cam_m = options_.p_gyro_cam_m;
  options.p_gyro_cam_sigma_m = options_.p_gyro_cam_sigma_m;
  options.gravity_m_s2 = options_.gravity_m_s2;
  options.accel_bias_sigma_m_s2 = options_.accel_bias_sigma_m_s2;
  for (const double span_s : kStartSpansS) {
    if (SecondsSince(starting_.front().stamp_ns, now_ns) < span_s - 0.1) return;
    const Result<VinsStart> start = InitialiseVins(StartInput(span_s), options);
    if (!start) {
      start_verdict_ = VinsVerdict::kNotConverged;
      start_explanation_ = start.error().message;
      return;
    }
    start_verdict_ = start->verdict;
    start_explanation_ = start->explanation;
    if (start->verdict != VinsVerdict::kReady) continue;
    if (const Status begun = Begin(*start); begun) return;
  }
}

// Where dead reckoning has come since the loss; nothing where inertial data are missing.
std::optional<Odometry::Anchor> Odometry::DeadReckoned(int64_t time_ns) const {
  const auto imu = IntegralOver(anchor_->time_ns, time_ns, anchor_->state);
  if (!imu) return std::nullopt;
  const double span_s = SecondsSince(anchor_->time_ns, time_ns);
  const ImuDelta delta = imu->Between(0.0, span_s);
  return Anchor{time_ns, Predict(anchor_->state, delta, options_.gravity_m_s2),
                PredictCovariance(anchor_->state, anchor_->covariance, delta,
                                  imu->Covariance(0.0, span_s, options_.noise), options_.walk)};
}

WindowPrior Odometry::FirstPrior() const {
  WindowPrior prior;
  const StateCovariance covariance =
      calibration_.total_covariance.value_or(calibration_.covariance);
  prior.calibration_covariance = covariance;
  prior.bias_gyro_sigma_rad_s = (covariance.diagonal().segment<3>(kStateBias).array() +
                                 kBiasAtOneTimeRadS * kBiasAtOneTimeRadS)
                                    .sqrt();
  prior.bias_accel_sigma_m_s2 = options_.accel_bias_sigma_m_s2;
  prior.p_gyro_cam_m = options_.p_gyro_cam_m;
  prior.p_gyro_cam_sigma_m = options_.p_gyro_cam_sigma_m;
  return prior;
}

// Yaw and position of what is reckoned; of what is not, nothing is known, unless it is the world's
// origin.
Eigen::Matrix4d Odometry::PlaceCovariance(const std::optional<Anchor>& reckoned) const {
  Eigen::Matrix4d place = Eigen::Matrix4d::Zero();
  if (reckoned) {
    Eigen::Matrix<double, 4, kNavSize> J = Eigen::Matrix<double, 4, kNavSize>::Zero();
    J.block<1, 3>(0, kNavRotation) = reckoned->state.q_world_gyro.toRotationMatrix().row(2);
    J.block<3, 3>(1, kNavPosition).setIdentity();
    place = J * reckoned->covariance * J.transpose();
  } else if (anchor_) {
    place.diagonal() << M_PI * M_PI, Vector3d::Constant(kUnknownPlaceM * kUnknownPlaceM);
  }
  return place;
}

// The start's keyframes, moved to where they are in our world, and the sightings of the last one.
Result<std::vector<LandmarkSighting>> Odometry::FillWindow(const VinsStart& start,
                                                           const Quaterniond& q_world_start,
                                                           const Vector3d& first_position,
                                                           OdometryWindow* window) const {
  NavigationState biases;
  biases.bias_gyro_rad_s = calibration_.bias_gyro_rad_s;  // the prior's
  biases.bias_accel_m_s2 = start.bias_accel_m_s2;
  int64_t before_ns = start.states.front().time_ns;
  auto frame = starting_.begin();
  std::vector<LandmarkSighting> sightings;
  for (const VinsState& state : start.states) {
    frame = std::find_if(frame, starting_.end(), [&](const QueuedFrame& candidate) {
      return candidate.stamp_ns == state.frame_stamp_ns;
    });
    const auto imu = IntegralOver(before_ns, state.time_ns, biases);
    if (frame == starting_.end() || !imu) return CannotEstimate("a frame of the start is gone");
    NewKeyframe keyframe;
    keyframe.frame_stamp_ns = frame->stamp_ns;
    keyframe.time_ns = frame->time_ns;
    keyframe.frame_number = frame->number;
    keyframe.state = biases;
    keyframe.state.q_world_gyro = q_world_start * state.q_world_gyro;
    keyframe.state.p_world_m = first_position + q_world_start * state.p_world_m;
    keyframe.state.v_world_m_s = q_world_start * state.v_world_m_s;
    keyframe.sightings = sightings = SightingsOf(*frame, *imu, before_ns);
    if (window->size() == 0) {
      window->AddFirst(std::move(keyframe), FirstPrior());
    } else {
      keyframe.link = Link(*imu, before_ns, before_ns, frame->time_ns, biases);
      window->Add(std::move(keyframe));
    }
    before_ns = frame->time_ns;
  }
  return sightings;
}

Result<Odometry::Started> Odometry::StartWindow(const VinsStart& start,
                                                const Quaterniond& q_world_start,
                                                const Vector3d& first_position,
                                                bool tracks_drift) const {
  OdometryWindowOptions options;
  options.gravity_m_s2 = options_.gravity_m_s2;
  options.kept_landmarks = tracks_drift ? 0 : options_.kept_landmarks;
  options.tracks_drift = tracks_drift;
  options.walk = options_.walk;
  Started started;
  started.window = std::make_unique<OdometryWindow>(calibration_, options);
  started.window->set_noise_px(noise_px_);
  Result<std::vector<LandmarkSighting>> sightings =
      FillWindow(start, q_world_start, first_position, started.window.get());
  if (!sightings) return tl::unexpected(sightings.error());
  started.sightings = *std::move(sightings);
  // The second solve is without the outliers of the first.
  for (int round = 0; round < 2; ++round) {
    if (Status solved = started.window->Solve(kFirstIterations); !solved) {
      return tl::unexpected(solved.error());
    }
  }
  return started;
}

Status Odometry::Begin(const VinsStart& start) {
  std::optional<Anchor> reckoned;
  if (anchor_) reckoned = DeadReckoned(start.states.front().time_ns);

  // From the start's world, whose axes are those of its first keyframe, to ours.
  Quaterniond q_world_start = ShortestToLevel(start.gravity_world_m_s2);
  Vector3d first_position = anchor_ ? anchor_->state.p_world_m : Vector3d::Zero();
  if (reckoned) {
    const Quaterniond q_first = q_world_start * start.states.front().q_world_gyro;
    const double yaw = YawBetween(reckoned->state.q_world_gyro, q_first);
    q_world_start = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * q_world_start;
    first_position = reckoned->state.p_world_m;
  }

  noise_px_ = start.noise_px;
  Result<Started> started = StartWindow(start, q_world_start, first_position, false);
  tracks_drift_ = started && started->window->residual_correlation() > kDriftCorrelation;
  // The start's noise is that of sightings, not of steps: the first fit of these says what theirs
  // is.
  for (int round = 0; tracks_drift_ && started && round < 2; ++round) {
    started = StartWindow(start, q_world_start, first_position, true);
    if (started) noise_px_ = started->window->last_noise_px();
  }
  if (!started) return tl::unexpected(started.error());
  window_ = std::move(started->window);
  ++segment_;
  segment_begin_m_ = first_position;
  if (anchor_ && !anchor_->believed) reckoned.reset();
  segment_covariance_ = PlaceCovariance(reckoned);
  const size_t keyframes_before = keyframes_.size();
  if (Status sound = AfterSolve(); !sound) {
    window_.reset();
    --segment_;
    keyframes_.resize(keyframes_before);
    start_verdict_ = VinsVerdict::kNotConverged;
    start_explanation_ = sound.error().message;
    return sound;
  }
  SetNewestDirections(started->sightings);
  const WindowKeyframe newest = window_->newest();
  OdometryPose pose;
  pose.frame_stamp_ns = newest.frame_stamp_ns;
  pose.time_ns = newest.time_ns;
  pose.segment = segment_;
  pose.state = newest.state;
  pose.covariance = InWorld(newest.state, newest_covariance_);
  for (const LandmarkSighting& seen : started->sightings) {
    pose.mapped_tracks += window_->IsMapped(seen.track_id);
  }
  poses_.push_back(pose);
  events_.push_back({OdometryEvent::Kind::kStarted, newest.time_ns, segment_, start.explanation});
  starting_.clear();
  return {};
}

}  // namespace camgyro
