// The starting point of a calibration: delay, orientation and bias from rotations alone, or a
// refusal that says why this recording cannot give one.
#ifndef CAMGYRO_ESTIMATOR_START_FIND_START_H_
#define CAMGYRO_ESTIMATOR_START_FIND_START_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "core/optical_stabiliser.h"
#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Of the gyro's motion, explained by the camera's: below, a start says so in a note.
constexpr double kWellExplained = 0.9;

struct StartOptions {
  double search_s = 2.0;        // half range of delays around the recording's guess, or zero
  int min_pairs = 20;           // camera rotations inside the gyro's time,
  double min_span_s = 1.0;      // and the time they cover
  double min_explained = 0.6;   // of the gyro's power, see StartResult::explained
  double max_runner_up = 0.7;   // see StartResult::runner_up_ratio
  double max_rate_ratio = 2.0;  // gyro against camera rates, either way
};

// One point of the curve of the delay search.
struct DelayResidual {
  double delay_s = 0.0;
  double residual = 1.0;  // unexplained fraction of the gyro's power, best rotation and bias
};

// One point of the focal scan.
struct FocalResidual {
  double focal_px = 0.0;
  double residual = 1.0;  // truncated squares of pan and tilt, relative to the gyro's
};

struct StartFocal {
  double value_px = 0.0;
  double sigma_px = 0.0;
  // Sigma below kDetermined and a distinct minimum; else value_px is the recording's guess or a
  // usual one.
  static constexpr double kDetermined = 0.1;  // of the focal length
  bool determined = false;
  // Residual of the best point / best residual more than 25 % away, 0..1: near 1, the motion does
  // not tell one field of view from the other.
  double runner_up_ratio = 1.0;
  std::vector<FocalResidual> curve;
};

struct StartReadout {
  double value_s = 0.0;
  double sigma_s = 0.0;
  // Sigma below 15 % of the frame interval and a distinct minimum; else value_s is what is usual.
  bool determined = false;
};

// What is taken where nothing tells: half of the frame interval, give or take what leaves out
// neither a global shutter nor one that reads all the time.
StartReadout UsualReadout(const Recording& recording);

// The frame interval, but not more than that of 30 frames/s: pictures are read no slower [s].
double UsualInterval(const Recording& recording);

// What rotations tell of a lens that follows the camera's turns (stabiliser_search.h).
struct StartStabiliser {
  OpticalStabiliser stabiliser;
  double gain = 0.0;  // of the lens: 0: it is held; 1: nothing of the stabilised angle is left
  double gain_sigma = 0.0;
  bool follows_turns = false;  // beyond doubt
  bool is_held = false;        // no gain that a stabiliser has, at 3 sigma
};

struct StartResult {
  // t_gyro = t_camera + delay, for the instant that the camera rotations belong to. Rotations of
  // whole pictures of a rolling shutter belong to the middle row: this is t_d + t_r / 2 then.
  double delay_middle_row_s = 0.0;
  double delay_sigma_s = 0.0;
  // The delay grows by so much per second, where that is beyond doubt (clock_rate.h); else zero.
  // delay_middle_row_s is then that at the first gyro stamp, and curve and runner-up are of the
  // camera on a clock of the gyro's rate.
  double clock_skew = 0.0;
  double clock_skew_sigma = 0.0;
  std::vector<DelayResidual> curve;  // ascending delays
  // Best against second best distinct minimum: ratio of unexplained fractions, 0..1; 1: equally
  // good. "Distinct" is outside of the best one's lobe (half way up to the curve's median).
  double runner_up_ratio = 1.0;
  double runner_up_delay_s = 0.0;

  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rotation_sigma_rad = Eigen::Vector3d::Zero();  // about the camera's axes
  // Directions that the motion determines to better than 0.1 rad. With fewer than 3 the others
  // come from the recording's guess or the nearest axis permutation, and a note says so.
  int rotation_axes_determined = 0;
  Eigen::Matrix3d nearest_permutation = Eigen::Matrix3d::Identity();  // camera -> gyro
  double permutation_angle_rad = 0.0;                                 // from it to q_gyro_cam

  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_sigma_rad_s = Eigen::Vector3d::Zero();

  // Fraction of the gyro's power about its mean that the camera explains (all three axes, one
  // rotation, one bias, one scale), outliers down-weighted.
  double explained = 0.0;
  double rate_ratio = 1.0;  // gyro rates / camera rates; 1 for a right focal length and unit
  double rate_ratio_sigma = 0.0;
  double inliers = 0.0;      // fraction of camera rotations whose residuals normal noise explains
  double noise_rad_s = 0.0;  // residual rate per axis and pair
  double gyro_rms_rad_s = 0.0;  // of the intervals' mean rates about their mean, all axes together
  int pairs = 0;

  std::optional<StartFocal> focal;            // set by FindStartAndFocal (focal_scan.h)
  std::optional<StartReadout> readout;        // the same; a declared one has no sigma
  std::optional<StartStabiliser> stabiliser;  // the same, where there are pairs enough
  std::vector<std::string> notes;
};

RoughAlignment RoughlyAligned(const StartResult& start, double readout_s);

// Finds the start from camera rotations between frames (from pictures or attitudes). Searches
// +-search_s around the recording's delay_s (a guess only); if nothing there fits, as with clocks
// of different origin, every alignment with half of the shorter stream inside the other. The guess
// of q_gyro_cam is used only for what the motion leaves open. Errors: kBadInput for rotations that
// do not fit the recording, kCannotEstimate with the reason for a start that is not trustworthy.
Result<StartResult> FindStart(const Recording& recording,
                              const std::vector<CameraRotation>& rotations,
                              const StartOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_FIND_START_H_
