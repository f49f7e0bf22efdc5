// What a Calibrator's worker does, in one thread: collects, finds a start, runs the sliding window.
#ifndef CAMGYRO_ONLINE_CALIBRATION_H_
#define CAMGYRO_ONLINE_CALIBRATION_H_

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/window/sliding_window.h"

namespace camgyro {

struct OnlineFrame {
  int64_t stamp_ns = 0;
  std::vector<TrackedPoint> points;  // by ascending track id
};

// Not thread-safe. Stamps of each stream increase, values are finite: the caller has checked.
class OnlineCalibration {
 public:
  struct Progress {
    bool estimating = false;
    std::string message;                  // why there is no start yet
    std::optional<Calibration> estimate;  // with covariance
    StateVector prior_sigma = StateVector::Zero();
    int64_t frame_stamp_ns = 0;
    double noise_px = 0.0;
    double clock_skew = 0.0;  // how fast the delay grows at that frame
    // What the frames' stamps are, since a start was searched; `repaired`: the estimate gives each
    // frame a time of its own, and these are that frame's and its spread.
    std::optional<StampReport> frame_stamps;
    double frame_offset_s = 0.0, frame_offset_sigma_s = 0.0, frame_spread_s = 0.0;
    std::string lens;  // as in Snapshot
    // Largest change of each parameter within the last two seconds of the camera; infinite before.
    StateVector movement = StateVector::Constant(std::numeric_limits<double>::infinity());
    uint64_t frames = 0, pairs_used = 0, pairs_skipped = 0;
    int starts = 0;
  };

  // start_s: of frames before the first search for a start. repair_stamps: frames whose stamps are
  // clearly times of arrival get times of their own. `listener` is called after each frame and each
  // solved window.
  OnlineCalibration(const CameraGuess& camera, MatchNoise noise, double start_s, bool repair_stamps,
                    std::function<void(const Progress&)> listener);

  void AddGyro(const GyroSample& sample);
  void AddFrame(OnlineFrame frame);
  const Progress& progress() const { return progress_; }

 private:
  void Collect();
  // Of the gyro's samples and of the frames that are here [s].
  double GyroSpan() const;
  double FrameSpan() const;
  Status TryStart();
  void ProcessWaiting();
  bool AddPair(const OnlineFrame& a, const OnlineFrame& b);
  // How far the second frame of the next pair lies from the first.
  size_t NextGap() const;
  void Remember(const WindowUpdate& update);
  void GiveUp();

  const CameraGuess camera_;
  const MatchNoise noise_;
  const double start_s_;
  const bool repair_stamps_;
  const std::function<void(const Progress&)> listener_;
  Progress progress_;

  std::deque<GyroSample> gyro_;     // not yet in the window
  std::deque<OnlineFrame> frames_;  // collected, or waiting for the gyro; the first was used
  int64_t next_start_ns_ = 0;       // camera clock: no search before
  bool lacks_gyro_ = false;         // for the search that is due
  std::optional<SlidingWindow> window_;
  int gap_ = 1;  // of the pairs, at most; see SelectPairs
  uint64_t pairs_begun_ = 0;
  uint64_t used_before_ = 0, skipped_before_ = 0;  // by windows that were given up
  uint64_t skipped_here_ = 0;                      // frames that waited too long
  int64_t last_solved_ns_ = 0;                     // frame of the latest solved window
  std::deque<std::pair<int64_t, Calibration>> history_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ONLINE_CALIBRATION_H_
