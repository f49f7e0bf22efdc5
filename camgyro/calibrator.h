// Calibrates while the sensors run. Link with camgyro::camgyro (libcamgyro.so).
//
//   auto calibrator = camgyro::api::Calibrator::Create(options, &error);
//   calibrator->AddGyro(stamp_ns, wx, wy, wz);            // from the gyro's thread
//   calibrator->AddImage(stamp_ns, {pixels, w, h, stride});  // from the camera's thread
//   if (calibrator->snapshot()->ready) ...                // from any one thread
//
// Threads: one producer per stream (gyro, accelerometer, frames), one reader, at the same time.
// Everything is estimated in one thread of the calibrator's own. Adding copies the data and
// returns; a snapshot never waits for estimation. Memory is bounded, whatever is fed: by
// max_frames_waiting images, 12 s of tracks, 60 s of gyro samples that wait for frames, 20 s of
// inertial samples for InitialiseVins, and the window. Nothing here throws or exits.
#ifndef CAMGYRO_CALIBRATOR_H_
#define CAMGYRO_CALIBRATOR_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "camgyro/export.h"
#include "camgyro/types.h"
#include "camgyro/vins.h"

namespace camgyro::api {

struct CalibratorOptions {
  CameraGuess camera;  // the size is needed
  // Ready means: total standard deviation below these, and steady for two seconds.
  double ready_focal = 0.01;      // of the focal length
  double ready_principal = 0.01;  // of the width
  double ready_readout_s = 1e-3;
  double ready_delay_s = 1e-3;
  double ready_bias_rad_s = 5e-3;
  double ready_rotation_rad = 10e-3;
  // Stamps of the gyro that are times of arrival are replaced by the sampling clock behind them,
  // with kAuto; samples then reach the estimate half a second later. The accelerometer's stay.
  // Frames whose stamps are times of arrival are given times of their own, found with the rest.
  Stamps stamps = Stamps::kAuto;
  // Sizes of undeclared effects, for the total sigmas.
  Device device = Device::kPhone;
  // Seconds of motion before the first search for a start.
  double start_s = 5.0;
  // Images (or frames of tracks) that wait for the worker; beyond, kQueueFull.
  std::size_t max_frames_waiting = 90;
};

enum class Stage {
  kCollecting,  // not enough frames yet, or no start was found: Snapshot::message says why
  kEstimating,
  kStopped,  // an error inside (out of memory, say): the message says which
};

enum class Readiness {
  kNoEstimate,
  kUndetermined,  // the motion so far tells next to nothing of it
  kImprecise,     // known, but its total sigma is not the one asked for, or not known yet
  kUnsteady,      // its estimate still moves by more than that
  kReady,
};
CAMGYRO_API const char* ToString(Readiness readiness) noexcept;

struct ParameterState {
  double value = 0.0;        // 0 for the three angles: see Calibration::q_gyro_cam_wxyz
  double sigma = 0.0;        // of noise
  double sigma_total = 0.0;  // with what undeclared effects may add; infinite: not known yet
  double wanted_sigma = 0.0;
  Readiness readiness = Readiness::kNoEstimate;
};

struct Snapshot {
  Stage stage = Stage::kCollecting;
  std::string message;      // for people
  std::string gyro_stamps;  // what they are, for people; empty before two seconds, or kRecorded
  // The same of the frames' stamps; empty before the first search for a start.
  std::string frame_stamps;
  // What the matches show of the lens that was not declared, for people: that there is a strong
  // one, which the estimate takes in, or that the declared distortion is of another camera, and is
  // left out. Empty if there is no such thing, and before the first search for a start.
  std::string lens;
  std::string doubt;  // for people: the pictures show an effect that the model lacks; or empty
  Calibration calibration;  // meaningful once `has_estimate`
  bool has_estimate = false;
  std::array<ParameterState, kParameters> parameters{};
  bool ready = false;               // all of them
  std::int64_t frame_stamp_ns = 0;  // the latest frame in the estimate
  // How fast calibration.delay_s grows there [s/s]: the clocks' rates differ by that.
  double clock_skew = 0.0;
  // Where frames' stamps are times of arrival (kAuto), each frame has a time of its own: by how
  // much later that frame was taken than its stamp and calibration.delay_s say, with its sigma; and
  // the standard deviation of that over the frames. Else 0.
  double frame_offset_s = 0.0, frame_offset_sigma_s = 0.0, frame_jitter_s = 0.0;
  double noise_px = 0.0;             // of a match, per axis
  double wrong_ratio = 0.0;          // share of the points of AddTracks that left their track
  std::uint64_t frames = 0;          // taken by the worker
  std::uint64_t frames_dropped = 0;  // answered with kQueueFull
  std::uint64_t pairs_used = 0, pairs_skipped = 0;
  int starts = 0;  // searches for a start so far; more than one after a refusal or a restart
};

class Calibrator {
 public:
  // Null for options that are not finite or out of range; *error says which, if it is not null.
  CAMGYRO_API static std::unique_ptr<Calibrator> Create(const CalibratorOptions& options,
                                                        std::string* error) noexcept;
  CAMGYRO_API ~Calibrator();
  Calibrator(const Calibrator&) = delete;
  Calibrator& operator=(const Calibrator&) = delete;

  // Angular rate in the gyro frame [rad/s], below 200 each. Stamps of all streams: |stamp| < 4e18.
  CAMGYRO_API AddResult AddGyro(std::int64_t stamp_ns, double x, double y, double z) noexcept;
  // Specific force in the gyro frame [m/s^2], below 2000 each; the gyro's clock. Only the VINS
  // initialisation needs it.
  CAMGYRO_API AddResult AddAccel(std::int64_t stamp_ns, double x, double y, double z) noexcept;
  // The stamp of the first row, camera clock. Either images or tracks; the first call decides, and
  // the other is then kOutOfRange.
  CAMGYRO_API AddResult AddImage(std::int64_t stamp_ns, const ImageView& image) noexcept;
  // In any order of ids, which are 0 or more. kOutOfRange: an id twice, a point further outside of
  // the picture than its size, more than 5000 points. A frame reaches the estimate when three more
  // have come: what jumps off its track and back is left out; a track that slips to another corner
  // goes on under a negative id.
  CAMGYRO_API AddResult AddTracks(std::int64_t stamp_ns, const TrackPoint* points,
                                  std::size_t count) noexcept;

  // The latest state; never null, and does not change once you have it. Renewed after every solve.
  CAMGYRO_API std::shared_ptr<const Snapshot> snapshot() const noexcept;

  // Starts a VIO on the latest frames with the present calibration. Takes part of a second, in the
  // calling thread; the producers go on.
  CAMGYRO_API VinsStart InitialiseVins(const VinsSettings& settings) const noexcept;

  // Waits until the worker has nothing left to do, for recordings that come faster than real time.
  // False after timeout_s.
  CAMGYRO_API bool WaitUntilIdle(double timeout_s) const noexcept;

 private:
  class Worker;
  explicit Calibrator(std::unique_ptr<Worker> worker);
  std::unique_ptr<Worker> worker_;
};

}  // namespace camgyro::api

#endif  // CAMGYRO_CALIBRATOR_H_
