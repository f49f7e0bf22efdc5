// What to simulate: the scenario file (docs/simulate.md) as a struct.
#ifndef CAMGYRO_SIMULATION_SCENARIO_H_
#define CAMGYRO_SIMULATION_SCENARIO_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "simulation/device_log.h"
#include "simulation/effects/all_effects.h"

namespace camgyro::simulation {

enum class MotionKind {
  kHandheld,
  kWalking,
  kRunning,
  kPanning,
  kRotation,
  kSingleAxis,
  kSlow,
  kFile
};

// The camera's way: a straight or circular path with steps and sway on it, and rotations about the
// camera's axes. Band-limited parts are sums of sinusoids with random phases.
struct MotionOptions {
  MotionKind kind = MotionKind::kHandheld;
  // Rms of the band-limited angular rate about the camera's x, y, z at level attitude [rad/s].
  Eigen::Vector3d rotation_rms_rad_s = Eigen::Vector3d::Constant(0.462);  // norm 0.8
  Eigen::Vector2d rotation_band_hz = {0.3, 2.5};
  double pan_rms_rad_s = 0.0;  // slow sweeps from side to side, added about the vertical
  double pan_period_s = 6.0;
  double speed_m_s = 1.2;      // along the path
  double heading_deg = 20.0;   // of the path, from the camera's forward to its right
  double path_radius_m = 0.0;  // 0: straight; else a circle, and the camera turns with it
  double sway_rms_m_s = 0.1;   // band-limited velocity, all axes together
  Eigen::Vector2d sway_band_hz = {0.1, 0.5};
  double step_hz = 0.0;        // 0: no steps
  double step_bounce_m = 0.0;  // amplitude up and down at step_hz; half of it sideways at half
  double step_nod_rad = 0.0;   // amplitude of the pitch at step_hz; half in roll at half
  std::string file;            // kind file: TUM or EuRoC ground truth
  bool file_is_body = false;   // poses of the gyro instead of the camera
  double file_knot_s = 0.05;   // spacing of the spline's knots
};
MotionOptions MotionPreset(MotionKind kind);

enum class SceneKind { kPoints, kGround, kRoom, kCorridor, kFacade, kMountains };
enum class DepthLaw { kUniform, kLogarithmic, kInverse };

// World frame: the level camera's at the start: x right, y down, z forward, origin at the start.
struct SceneOptions {
  SceneKind kind = SceneKind::kPoints;
  DepthLaw depth_law = DepthLaw::kLogarithmic;  // kind points
  Eigen::Vector2d depth_m = {1.5, 20.0};        // kind points
  double ground_m = 1.6;                        // kinds ground, facade: height of the camera
  double distance_m = 8.0;                      // kind facade: of the wall
  Eigen::Vector3d room_m = {7.0, 3.0, 9.0};     // kinds room, corridor: width, height, length
  Eigen::Vector2d block_m = {3.0, 3.0};  // kind corridor: width, length of what it goes round
  double far_m = 2000.0;                 // kinds ground, facade, mountains: of the horizon
  double moving_fraction = 0.0;          // kind points: of them moving by themselves
  int moving_objects = 0;                // other kinds: boxes that move
  double moving_speed_m_s = 1.0;
};

struct CameraOptions {
  int width_px = 720, height_px = 480;
  double focal_px = 650.0;                      // of the rows
  std::optional<Eigen::Vector2d> principal_px;  // centre of the picture, if absent
  double rate_hz = 30.0;
  double readout_s = 0.02;  // negative: bottom to top
  double delay_s = 0.015;   // t_gyro = t_camera + delay
  double exposure_s = 0.005;
  double exposure_swing = 0.0;      // relative amplitude of its slow changes
  double drop_fraction = 0.0;       // frames that are missing
  bool declare_intrinsics = false;  // sensor.yaml holds the truth as a guess
};

struct MountOptions {
  // Camera vectors into the gyro frame. Default: an Android phone's axes, turned by a few degrees.
  Eigen::Quaterniond q_gyro_cam = DefaultRotation();
  Eigen::Vector3d p_gyro_cam_m = {0.03, 0.05, 0.0};  // camera in the gyro frame; accel only
  static Eigen::Quaterniond DefaultRotation();
};

struct GyroOptions {
  double rate_hz = 200.0;
  double noise_density_rad_s_rtHz = 2.1e-4;  // 0.003 rad/s per sample at 200 Hz
  Eigen::Vector3d bias_rad_s = {0.01, -0.02, 0.015};
  double bias_walk_rad_s2_rtHz = 1e-5;
  bool averaged = false;        // samples are means over their interval
  double stamp_jitter_s = 0.0;  // sigma; samples are even, stamps are not
  // Stamps of arrival: a latency for each sample, exponential with this mean; one in
  // kSamplesPerStall stalls for up to stamp_stall_s more, and holds up those behind it.
  double stamp_latency_s = 0.0;
  double stamp_stall_s = 0.0;
  static constexpr int kSamplesPerStall = 200;
  double drop_fraction = 0.0;
  double quantum_rad_s = 0.0;  // 0: none
  bool accelerometer = true;
  double accel_noise_density_m_s2_rtHz = 2e-3;
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
  double accel_bias_walk_m_s3_rtHz = 0.0;
};

struct TrackOptions {
  int count = 100;  // per frame
  double noise_px = 1.0;
  // Of the logarithm of the noise, from frame to frame around noise_px: pictures are blurred and
  // dark for a while. Neighbours share most of it, with a memory of kNoiseMemoryS.
  double noise_scatter = 0.0;
  static constexpr double kNoiseMemoryS = 0.25;
  // False: independent per observation. True: a tracker that re-anchors at every frame; the track
  // then walks over the scene, and the noise of a pair is in its second image only.
  bool reanchored = false;
  double outlier_fraction = 0.0;
  double outlier_px = 20.0;       // sigma of the error of an outlier
  double mean_life_frames = 0.0;  // 0: until it leaves the picture
};

// Attitudes of the camera instead of image motion, as an app or structure from motion delivers
// them: of a frame's first row, which is all that there is of its readout. Both zero: none.
struct AttitudeOptions {
  double noise_rad = 0.0;  // of each attitude, per axis
  double walk_rad = 0.0;   // of the rotation from one to the next, per axis: errors add up
  bool wanted() const { return noise_rad > 0.0 || walk_rad > 0.0; }
};

enum class VideoFormat { kNone, kPng, kMp4 };
struct VideoOptions {
  VideoFormat format = VideoFormat::kNone;  // kNone: tracks only
  int max_blur_samples = 8;                 // over the exposure; at least 4
  double vignetting = 0.3;                  // loss of light in the corners
  double full_well_electrons = 8000.0;      // photon noise; 0: none
  double read_noise_electrons = 6.0;
  int crf = 18;  // H.264 quality, 0 (lossless) to 51
};

struct Scenario {
  uint64_t seed = 1;
  double duration_s = 10.0;              // between the first and the last frame
  double margin_s = 0.5;                 // of gyro samples before and after the frames
  int64_t start_ns = 1'000'000'000'000;  // first gyro stamp
  MotionOptions motion;
  SceneOptions scene;
  CameraOptions camera;
  MountOptions mount;
  GyroOptions gyro;
  TrackOptions tracks;
  AttitudeOptions attitudes;
  VideoOptions video;
  Effects effects;
  // A device's own log. With one, the camera turns as its gyro did (the translation is that of
  // `motion`), samples are taken at its stamps, and pictures, if it has any, at theirs;
  // LoadScenario sets duration and rates to the log's.
  DeviceLogFiles log_files;
  std::shared_ptr<const DeviceLog> log;
};

// Reads a scenario file. Overrides are "section.key=value" with a YAML value and win over the file.
// What the file does not name keeps its default; motion.kind first sets the preset of its kind. An
// unknown key, a wrong type or a value out of its range is an error that names line and key, and
// the nearest known key. LoadScenario also reads the log, of which ParseScenario takes the names.
// Relative file names are relative to the scenario file.
Result<Scenario> LoadScenario(const std::string& path,
                              const std::vector<std::string>& overrides = {});
Result<Scenario> ParseScenario(const std::string& yaml,
                               const std::vector<std::string>& overrides = {});

// Names of the effects that a scenario switches on, in the catalogue's order.
std::vector<std::string> ActiveEffects(const Effects& effects);

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_SCENARIO_H_
