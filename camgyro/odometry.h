// Where the device goes, while the sensors run: a sliding window over tracks, gyro and
// accelerometer that knows the rolling shutter and both clocks (docs/odometry.md). Link with
// camgyro::camgyro.
//
//   auto odometry = camgyro::api::Odometry::Create(calibrator->snapshot()->calibration, {},
//   &error); odometry->AddGyro(...), AddAccel(...), AddTracks(...); for (const OdometryPose& pose :
//   odometry->Take().poses) ...
//
// Threads: any of them, at the same time; each call waits for the others. A frame is processed in
// the call that completes its data, a few milliseconds, and some tens for a keyframe. Memory is
// bounded by the window, and by 25 s of samples after a loss, if what is known is taken. Nothing
// here throws or exits.
#ifndef CAMGYRO_ODOMETRY_H_
#define CAMGYRO_ODOMETRY_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "camgyro/export.h"
#include "camgyro/types.h"
#include "camgyro/vins.h"

namespace camgyro::api {

struct OdometrySettings {
  // Noise, lever arm, gravity; window_s is not used.
  VinsSettings inertial;
  // Random walks of the biases, of one axis.
  double gyro_bias_walk_rad_s2_rtHz = 2e-5;
  double accel_bias_walk_m_s3_rtHz = 3e-3;
  int keyframes = 16;  // in the window, 6 to 60
};

// Of the gyro frame when the middle row of a frame was exposed. World: z up, origin and heading of
// the first keyframe.
struct OdometryPose {
  std::int64_t frame_stamp_ns = 0;  // camera clock
  std::int64_t time_ns = 0;         // gyro clock
  int segment = 0;                  // counts from 0; a new one after every loss
  std::array<double, 4> q_world_gyro_wxyz{1.0, 0.0, 0.0, 0.0};
  Vec3 p_world_m{}, v_world_m_s{}, bias_gyro_rad_s{}, bias_accel_m_s2{};
  // Row after row: rotation (right perturbation of q_world_gyro) [rad], position, velocity, gyro
  // bias, accelerometer bias.
  std::array<double, 225> covariance{};
  int mapped_tracks = 0;  // of the frame's, with a landmark in the window
};

struct OdometryEvent {
  bool started = false;      // else: lost
  std::int64_t time_ns = 0;  // gyro clock
  int segment = 0;
  std::string explanation;
};

struct OdometryUpdate {
  bool tracking = false;
  std::string message;  // why there is no start yet; for people
  std::vector<OdometryPose> poses;
  std::vector<OdometryPose> keyframes;  // as they leave the window, with what later frames said
  std::vector<OdometryEvent> events;
};

class Odometry {
 public:
  // The total covariance is the prior of the calibration, or that of noise where it is not known.
  // Null for what is not finite or out of range; *error says which, if it is not null.
  CAMGYRO_API static std::unique_ptr<Odometry> Create(const Calibration& calibration,
                                                      const OdometrySettings& settings,
                                                      std::string* error) noexcept;
  CAMGYRO_API ~Odometry();
  Odometry(const Odometry&) = delete;
  Odometry& operator=(const Odometry&) = delete;

  // Units, limits and answers are those of Calibrator.
  CAMGYRO_API AddResult AddGyro(std::int64_t stamp_ns, double x, double y, double z) noexcept;
  CAMGYRO_API AddResult AddAccel(std::int64_t stamp_ns, double x, double y, double z) noexcept;
  CAMGYRO_API AddResult AddTracks(std::int64_t stamp_ns, const TrackPoint* points,
                                  std::size_t count) noexcept;

  // What has become known since the last call. Without memory for it: nothing, and it is lost.
  CAMGYRO_API OdometryUpdate Take() noexcept;

  // No more is to come: keyframes that are in the window leave it.
  CAMGYRO_API void Finish() noexcept;

  // As refined on the way, with its covariance; total_covariance is the same.
  CAMGYRO_API Calibration calibration() const noexcept;

 private:
  class State;
  explicit Odometry(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace camgyro::api

#endif  // CAMGYRO_ODOMETRY_H_
