// The sliding window of the odometry: keyframes with their biases, landmarks seen by rolling
// shutters, and the calibration with what is believed of it, in one problem that Ceres solves.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_ODOMETRY_WINDOW_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_ODOMETRY_WINDOW_H_

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/calibration.h"
#include "core/result.h"
#include "estimator/odometry/navigation_state.h"
#include "estimator/odometry/reduced_information.h"
#include "estimator/odometry/triangulation.h"
#include "estimator/odometry/window_parts.h"
#include "factors/marginal_prior.h"
#include "factors/preintegration.h"
#include "factors/row_projection.h"

namespace camgyro {

struct OdometryWindowOptions {
  // Landmarks that stay in the prior while their tracks last, at most; 0: all are split.
  int kept_landmarks = 80;
  // The tracker re-anchors at every frame: errors of a track add up from frame to frame, and only
  // what each sighting adds to the one before is independent (factors/drift_step.h). Landmarks are
  // not kept then.
  bool tracks_drift = false;
  double gravity_m_s2 = 9.80665;
  BiasWalkDensity walk;
};

// What is believed before the first keyframe's pictures. Its yaw and position are the frame of
// everything that follows, and held; roll and pitch are left to the data.
struct WindowPrior {
  Eigen::Vector3d bias_gyro_sigma_rad_s = Eigen::Vector3d::Constant(1e-3);
  double bias_accel_sigma_m_s2 = 0.2;
  Eigen::Vector3d p_gyro_cam_m = Eigen::Vector3d::Zero();
  double p_gyro_cam_sigma_m = 0.05;
  // Of the deviation from the calibration that measurements are made with. That of its gyro bias is
  // not used: biases are the keyframes'.
  StateCovariance calibration_covariance = StateCovariance::Zero();
};

struct LandmarkSighting {
  int64_t track_id = 0;
  RowProjectionMeasurement projection;
};

struct NewKeyframe {
  int64_t frame_stamp_ns = 0;  // camera clock
  int64_t time_ns = 0;         // gyro clock: exposure of the frame's middle row
  int64_t frame_number = 0;    // counts all frames, keyframes or not
  NavigationState state;       // a first guess
  // From the keyframe before, which the first does not have.
  std::optional<BiasedPreintegrationMeasurement> link;
  std::vector<LandmarkSighting> sightings;  // by ascending track id
};

struct WindowKeyframe {
  int64_t frame_stamp_ns = 0, time_ns = 0, frame_number = 0;
  NavigationState state;
};

struct MappedPoint {
  int64_t track_id = 0;
  Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();
  int sightings = 0;
};

class OdometryWindow {
 public:
  OdometryWindow(const Calibration& calibration, const OdometryWindowOptions& options);
  ~OdometryWindow();
  OdometryWindow(const OdometryWindow&) = delete;
  OdometryWindow& operator=(const OdometryWindow&) = delete;

  // The first one takes the prior, the others must have a link.
  void AddFirst(NewKeyframe keyframe, const WindowPrior& prior);
  void Add(NewKeyframe keyframe);
  // Takes the newest keyframe out again, with its sightings; the next one's link must begin at the
  // one before. Not the first.
  void RemoveNewest();

  // Landmarks from their sightings, then everything together; sightings beyond 4 sigma leave.
  // Error: kCannotEstimate if Ceres finds no usable solution.
  Status Solve(int max_iterations);

  // The oldest of at least three keyframes leaves: what its factors say becomes part of the prior.
  // Landmarks that it and the newest keyframe see, from directions that differ by 0.3 rad, are
  // kept, up to kept_landmarks: the prior speaks of them, until the newer half of the window does
  // not see them any more. Any other landmark that it sees is split: what the older half of the
  // window saw of it goes with it, what the newer half saw of it stays, so that nothing is used
  // twice. Returns the keyframe as it was last estimated. Error: kCannotEstimate.
  Result<WindowKeyframe> MarginaliseOldest();

  size_t size() const { return keyframes_.size(); }
  WindowKeyframe keyframe(size_t i) const;
  WindowKeyframe newest() const { return keyframe(size() - 1); }
  // The share of the newest keyframe's sightings that the last Solve believed, of those of known
  // landmarks, and of tracks that would be known if the motion were right: seen from directions
  // that differ by 0.05 rad, but by lines that meet nowhere. And how many there were.
  double inlier_ratio() const { return inlier_ratio_; }
  int known_sightings() const { return known_sightings_; }
  // Of a sighting, or, of tracks that drift, of a step from one frame to the next one.
  double noise_px() const { return noise_px_; }
  double last_noise_px() const { return last_noise_px_; }  // as the last Solve alone has it
  // Of residuals of neighbouring sightings of the same landmark in the last Solve: below 0 where
  // noise is independent, since the landmark has taken its part; above where errors of tracks add
  // up. 0 of tracks that are taken to drift, and where there are too few.
  double residual_correlation() const { return residual_correlation_; }
  void set_noise_px(double noise_px) { noise_px_ = noise_px; }

  const Eigen::Vector3d& p_gyro_cam_m() const { return arm_; }
  const StateVector& calibration_deviation() const { return calibration_; }
  bool IsMapped(int64_t track_id) const;
  std::vector<MappedPoint> Points() const;

  // Covariances of states, of the calibration's deviation and of p_gyro_cam.
  struct Covariance {
    std::vector<NavigationCovariance> states;  // of all keyframes, or of the oldest and the newest
    StateCovariance calibration = StateCovariance::Zero();
    Eigen::Matrix3d p_gyro_cam = Eigen::Matrix3d::Zero();
  };
  // Error: kCannotEstimate if the window does not determine them.
  Result<Covariance> ComputeCovariance(bool of_all_keyframes);

 private:
  class Program;

  struct PriorBlock {
    double* values = nullptr;
    int size = 3;
    MarginalPrior::Kind kind = MarginalPrior::Kind::kVector;
  };
  void SetPrior(std::vector<PriorBlock> blocks, const SquareRoot& root);
  void AddSightings(NewKeyframe* keyframe);
  ViewingLine LineOf(const OdometrySighting& sighting) const;
  bool Believable(const OdometryLandmark& landmark, const OdometrySighting& sighting) const;
  void DropUnbelievable(OdometryLandmark* landmark) const;
  void TriangulateNew();
  void DropOutliersAndUpdateNoise(const Program& program);
  void Recentre();

  // The steps of MarginaliseOldest (window_marginalisation.cc).
  double ParallaxRad(const OdometrySighting& a, const OdometrySighting& b) const;
  void ChooseKept();
  // How many of a landmark's sightings, which are by age, are of the window's older half; and how
  // many go with the oldest keyframe.
  size_t OlderSightings(const OdometryLandmark& landmark) const;
  size_t LeavingSightings(const OdometryLandmark& landmark) const;
  // Columns of what leaves, then of what the prior may speak of; returns the number of the former.
  int LayOutMarginalisation(Program* program, ReducedInformation* information,
                            std::vector<PriorBlock>* staying);
  bool AddWhatLeaves(const Program& program, ReducedInformation* information) const;
  void RemoveWhatLeaves();
  void SetPriorOfWhatIsKnown(const std::vector<PriorBlock>& blocks, const Quadratic& left);

  const OdometryWindowOptions options_;
  const Eigen::Quaterniond q_gyro_cam_;
  // Positions inside are counted from here, so that landmarks stay near the origin, where
  // homogeneous points are well scaled.
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  std::deque<OdometryNode> keyframes_;
  std::map<int64_t, OdometryLandmark> landmarks_;  // by track
  Eigen::Vector3d gravity_{0.0, 0.0, -1.0};
  Eigen::Vector3d arm_ = Eigen::Vector3d::Zero();
  StateVector calibration_ = StateVector::Zero();
  std::unique_ptr<MarginalPrior> prior_;
  std::vector<PriorBlock> prior_blocks_;
  double noise_px_ = 1.0;
  double inlier_ratio_ = 1.0;
  int known_sightings_ = 0;
  int untriangulable_ = 0;  // tracks in the newest keyframe that are of no point
  double residual_correlation_ = 0.0;
  double last_noise_px_ = 1.0;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_ODOMETRY_WINDOW_H_
