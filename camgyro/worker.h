// The thread of a Calibrator and its queues: producers leave their data here, the thread takes them
// to the estimate, and what comes out is published as a snapshot.
#ifndef CAMGYRO_WORKER_H_
#define CAMGYRO_WORKER_H_

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "camgyro/calibrator.h"
#include "camgyro/online_calibration.h"
#include "camgyro/recent_window.h"
#include "camgyro/total_error.h"
#include "core/calibration.h"
#include "core/recording.h"
#include "frontend/streaming_clock.h"
#include "frontend/track_cleaner.h"
#include "frontend/track_jumps.h"
#include "frontend/tracker.h"

namespace camgyro::api {

// The functions are those of Calibrator; but they may throw (no memory, no thread).
class Calibrator::Worker {
 public:
  Worker(const CalibratorOptions& options, const camgyro::CameraGuess& camera);
  ~Worker();

  AddResult AddGyro(const GyroSample& sample);
  AddResult AddAccel(const AccelSample& sample);
  AddResult AddImage(std::int64_t stamp_ns, const ImageView& view);
  AddResult AddTracks(std::int64_t stamp_ns, const TrackPoint* points, std::size_t count);
  std::shared_ptr<const Snapshot> snapshot() const { return std::atomic_load(&snapshot_); }
  VinsStart InitialiseVins(const VinsSettings& settings) const;
  bool WaitUntilIdle(double timeout_s) const;

 private:
  struct FrameIn {
    std::int64_t stamp_ns = 0;
    cv::Mat image;                     // a copy; empty with tracks
    std::vector<TrackedPoint> points;  // by ascending id
  };

  // The order of a frame, before its data are copied.
  std::optional<AddResult> CheckFrame(std::int64_t stamp_ns, MatchNoise noise);
  AddResult Queue(FrameIn frame);

  // In the worker's thread.
  void Run();
  void TakeAndProcess(std::unique_lock<std::mutex>* lock);
  std::vector<GyroSample> TakeGyro(const std::vector<GyroSample>& recorded);
  void Process(const std::vector<GyroSample>& recorded, FrameIn* frame, MatchNoise noise);
  // The frame that goes to the estimate when this one has come, without wrong points: itself, if it
  // is a picture; of given tracks, one that came StreamingTrackJumps::kBehind before; none at
  // first.
  std::optional<OnlineFrame> WithoutWrongPoints(FrameIn* frame);
  void RenewTotal(const OnlineCalibration::Progress& progress);
  void Publish(const OnlineCalibration::Progress& of_noise);
  void Stop(const std::string& message) noexcept;

  const CalibratorOptions options_;
  const camgyro::CameraGuess camera_;
  std::shared_ptr<const Snapshot> snapshot_;  // through std::atomic_load and _store only

  // Shared by producers, reader and worker.
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  mutable std::condition_variable idle_;
  bool stop_ = false, stopped_ = false, busy_ = false;
  std::vector<GyroSample> gyro_in_;
  std::deque<FrameIn> frames_in_;
  std::optional<MatchNoise> noise_;  // images or tracks, once the first came
  std::optional<std::int64_t> last_gyro_ns_, last_accel_ns_, last_frame_ns_;
  std::uint64_t dropped_ = 0;
  std::optional<camgyro::Calibration> latest_;
  RecentWindow recent_;

  // The worker's own.
  KltTracker tracker_;
  TrackCleaner cleaner_;                     // of pictures
  StreamingTrackJumps jumps_;                // of given tracks
  std::deque<std::int64_t> held_stamps_ns_;  // of the frames that it holds
  StreamingClock clock_;
  std::optional<OnlineCalibration> online_;
  TotalError total_;
  std::deque<GyroSample> early_gyro_;  // before the first frame
  std::thread thread_;                 // last: starts when all else is there
};

}  // namespace camgyro::api

#endif  // CAMGYRO_WORKER_H_
