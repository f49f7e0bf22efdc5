// Visual-inertial odometry for a calibrated rolling-shutter camera: positions, velocities and
// biases, frame by frame. The rest of the system of Feng, Li & Dai, CSNC 2018, section 2, on the
// factors of its initialisation: every observation at its own row's time, with the calibration's
// uncertainty as a prior.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_ODOMETRY_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_ODOMETRY_H_

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/imu_integral.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/odometry/navigation_state.h"
#include "estimator/odometry/odometry_window.h"
#include "estimator/vins/initialise.h"

namespace camgyro {

struct OdometryOptions {
  int keyframes = 16;       // in the window
  int kept_landmarks = 80;  // at most, that stay known after the window has left them behind
  // A frame becomes a keyframe when this long has passed since the last one, or earlier, once
  // tracked points have moved against each other by this angle or many of them were lost.
  double keyframe_interval_s = 0.3;
  double keyframe_parallax_rad = 0.1;
  ImuNoise noise;
  BiasWalkDensity walk;
  double gravity_m_s2 = 9.80665;
  double accel_bias_sigma_m_s2 = 0.2;  // around zero, before the first picture
  // Camera in the gyro frame, as far as it is known [m].
  Eigen::Vector3d p_gyro_cam_m = Eigen::Vector3d::Zero();
  double p_gyro_cam_sigma_m = 0.05;
};

// Where the gyro frame was when the middle row of a frame was exposed.
struct OdometryPose {
  int64_t frame_stamp_ns = 0;  // camera clock
  int64_t time_ns = 0;         // gyro clock
  // Stretches between losses, from 0. Within one the errors of poses belong together.
  int segment = 0;
  NavigationState state;
  NavigationCovariance covariance = NavigationCovariance::Zero();
  int mapped_tracks = 0;  // of the frame's, with a landmark in the window
};

struct OdometryEvent {
  enum class Kind { kStarted, kLost };
  Kind kind = Kind::kStarted;
  int64_t time_ns = 0;  // gyro clock
  int segment = 0;
  std::string explanation;  // for people
};

// Feeds are in order within each stream; the streams may be interleaved in any way. What is known
// is a function of what came in, whatever the interleaving. Memory is bounded by the window, by
// the longest stretch that a start is looked for in, and by 20 s of inertial samples after a loss.
// World frame: z up; origin and heading are the first keyframe's.
class Odometry {
 public:
  // The calibration's covariance (the total one where it is known) is the prior of its values,
  // which are refined.
  Odometry(const Calibration& calibration, const OdometryOptions& options);
  ~Odometry();
  Odometry(const Odometry&) = delete;
  Odometry& operator=(const Odometry&) = delete;

  // Errors: kBadInput for what is not finite or not later than what came before; it is left out.
  Status AddGyro(const GyroSample& sample);
  Status AddAccel(const AccelSample& sample);
  // Tracks by ascending id.
  Status AddFrame(int64_t stamp_ns, std::vector<TrackedPoint> tracks);
  // No more is to come: keyframes that are still in the window leave it.
  void Finish();

  // What has become known since the last call: poses of frames, from the newest keyframe at a start
  // on; keyframes with what later frames have said of them, as they leave the window; points.
  std::vector<OdometryPose> TakePoses();
  std::vector<OdometryPose> TakeKeyframes();
  std::vector<OdometryEvent> TakeEvents();
  std::vector<MappedPoint> Points() const;  // in the window

  bool tracking() const { return window_ != nullptr; }
  // Why there has been no start yet.
  VinsVerdict start_verdict() const { return start_verdict_; }
  const std::string& start_explanation() const { return start_explanation_; }
  // The calibration as refined, with its covariance; p_gyro_cam with its sigmas.
  const Calibration& calibration() const { return refined_; }
  const Eigen::Vector3d& p_gyro_cam_m() const { return p_gyro_cam_m_; }
  const Eigen::Vector3d& p_gyro_cam_sigma_m() const { return p_gyro_cam_sigma_m_; }
  // Of a sighting, or, of tracks that drift, of a step from one frame to the next one.
  double noise_px() const { return noise_px_; }
  // The tracker's errors add up along its tracks, as the residuals of the last start had it.
  bool tracks_drift() const { return tracks_drift_; }

 private:
  struct QueuedFrame {
    int64_t stamp_ns = 0;
    int64_t time_ns = 0;  // gyro clock: exposure of the middle row
    int64_t number = 0;
    std::vector<TrackedPoint> tracks;
  };
  // Where a segment ended, and how well it was known.
  struct Anchor {
    int64_t time_ns = 0;
    NavigationState state;
    NavigationCovariance covariance;
    // Nothing has contradicted it. Else what the window believed, or the inertial data, were wrong
    // before anybody saw it, and the covariance says nothing.
    bool believed = true;
  };

  void Advance();
  void Process(QueuedFrame frame);
  void TryStart();
  VinsInput StartInput(double span_s) const;
  Status Begin(const VinsStart& start);
  std::optional<Anchor> DeadReckoned(int64_t time_ns) const;
  WindowPrior FirstPrior() const;
  Eigen::Matrix4d PlaceCovariance(const std::optional<Anchor>& reckoned) const;
  // The window of a start, solved, and the sightings of its newest keyframe.
  struct Started {
    std::unique_ptr<OdometryWindow> window;
    std::vector<LandmarkSighting> sightings;
  };
  Result<Started> StartWindow(const VinsStart& start, const Eigen::Quaterniond& q_world_start,
                              const Eigen::Vector3d& first_position, bool tracks_drift) const;
  Result<std::vector<LandmarkSighting>> FillWindow(const VinsStart& start,
                                                   const Eigen::Quaterniond& q_world_start,
                                                   const Eigen::Vector3d& first_position,
                                                   OdometryWindow* window) const;
  void Track(const QueuedFrame& frame);
  Status AddKeyframe(const QueuedFrame& frame, double parallax_rad);
  Status AfterSolve();
  void SetNewestDirections(const std::vector<LandmarkSighting>& sightings);
  void Lose(int64_t time_ns, const std::string& why, bool contradicted = false);
  void Leave(const WindowKeyframe& keyframe, const NavigationCovariance& covariance);
  void LeaveAll();
  NavigationCovariance InWorld(const NavigationState& state,
                               const NavigationCovariance& covariance) const;

  std::optional<ImuIntegral> IntegralOver(int64_t from_ns, int64_t to_ns,
                                          const NavigationState& biases) const;
  void ForgetInertial();
  std::vector<LandmarkSighting> SightingsOf(const QueuedFrame& frame, const ImuIntegral& imu,
                                            int64_t origin_ns) const;
  BiasedPreintegrationMeasurement Link(const ImuIntegral& imu, int64_t origin_ns, int64_t from_ns,
                                       int64_t to_ns, const NavigationState& biases) const;

  const Calibration calibration_;
  const OdometryOptions options_;
  const double reach_s_;  // of a frame's rows about its middle one, and rounding
  std::vector<GyroSample> gyro_;
  std::vector<AccelSample> accel_;
  int64_t last_gyro_ns_, last_accel_ns_, last_frame_ns_;
  int64_t frames_ = 0;
  std::deque<QueuedFrame> pending_;   // their inertial data are not complete
  std::deque<QueuedFrame> starting_;  // of the last seconds, while there is no start
  int64_t next_try_ns_;

  std::unique_ptr<OdometryWindow> window_;
  // Of the newest keyframe: covariance; directions of its points in its gyro frame, by track; their
  // parallax against the keyframe before.
  NavigationCovariance newest_covariance_ = NavigationCovariance::Zero();
  std::map<int64_t, Eigen::Vector3d> newest_directions_;
  double newest_parallax_rad_ = 0.0;
  int contradictions_ = 0;  // keyframes in a row whose pictures contradict the motion
  std::optional<Anchor> anchor_;
  int segment_ = -1;
  // Where the segment began, and how well that is known: yaw and position. The window counts from
  // there.
  Eigen::Vector3d segment_begin_m_ = Eigen::Vector3d::Zero();
  Eigen::Matrix4d segment_covariance_ = Eigen::Matrix4d::Zero();

  VinsVerdict start_verdict_ = VinsVerdict::kTooFewTracks;
  std::string start_explanation_ = "no frames yet";
  Calibration refined_;
  Eigen::Vector3d p_gyro_cam_m_, p_gyro_cam_sigma_m_;
  double noise_px_ = 0.0;
  bool tracks_drift_ = false;
  std::vector<OdometryPose> poses_, keyframes_;
  std::vector<OdometryEvent> events_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_ODOMETRY_H_
