// The odometry of a whole recording.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_FOLLOW_RECORDING_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_FOLLOW_RECORDING_H_

#include <functional>
#include <string>
#include <vector>

#include "estimator/odometry/odometry.h"

namespace camgyro {

struct OdometryRun {
  std::vector<OdometryPose> poses;      // of every frame from the first start on, as known then
  std::vector<OdometryPose> keyframes;  // with what the window's later frames have said of them
  std::vector<OdometryEvent> events;
  std::vector<MappedPoint> points;  // of all landmarks, as last known
  int segments = 0;                 // 0: it never started, for the reason that follows
  VinsVerdict start_verdict = VinsVerdict::kTooFewTracks;
  std::string start_explanation;
  Calibration calibration;  // as refined, with its covariance
  Eigen::Vector3d p_gyro_cam_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_gyro_cam_sigma_m = Eigen::Vector3d::Zero();
  double noise_px = 0.0;  // of a sighting; of tracks that drift, of a step from frame to frame
  bool tracks_drift = false;
  double path_m = 0.0;  // sum of the ways between keyframes, within segments
};

// One line for people: whether it followed the device, or why not.
std::string VerdictOf(const OdometryRun& run);

// Noise as the recording declares it, in the place of what the options say.
OdometryOptions WithDeclaredNoise(OdometryOptions options, const GyroInfo& gyro);

// Does the recording have what odometry needs? Asked before minutes of tracking and calibration;
// pictures count, since they can be tracked. Error: kBadInput.
Status CheckCanBeFollowed(const Recording& recording);

// `progress` gets the share that is done and may be null. Errors: kBadInput for a recording without
// tracks, as CheckCanBeFollowed, or with samples that are not finite or not in order.
Result<OdometryRun> FollowRecording(const Recording& recording, const Calibration& calibration,
                                    const OdometryOptions& options,
                                    const std::function<void(double)>& progress);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_FOLLOW_RECORDING_H_
