// The online estimator: gyro samples and pairs of frames in real-time order, constant cost per
// frame, bounded memory.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_SLIDING_WINDOW_H_
#define CAMGYRO_ESTIMATOR_WINDOW_SLIDING_WINDOW_H_

#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <string>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/window/noise_scale.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_selection.h"
#include "estimator/window/track_lean.h"

namespace camgyro {

struct SlidingWindowOptions {
  PairGraphOptions graph;
  // Kept once the estimate has settled. With 10, errors and NEES are the same (docs/lab/pairs.md),
  // and a step takes 1.4 times as long.
  int window_pairs = 6;

  // Until then nothing is marginalised, up to this many pairs: a prior that was linearised at a
  // poor estimate stays wrong for ever. The window is then solved
  // every `unsettled_stride` pairs.
  int unsettled_pairs = 60;
  int unsettled_stride = 5;
  // Once it holds so many pairs, the motion is one that determines little: then so often.
  int undetermined_stride = 10;
  // Settled: the standard deviations are below these. Parameters that the motion never determines
  // hold the window open until unsettled_pairs.
  double settled_focal = 0.01;  // of the focal length
  double settled_readout_s = 1e-3;
  double settled_delay_s = 0.5e-3;
  double settled_rotation_rad = 5e-3;

  // The rates of the clocks walk by that in a second [1/sqrt(s)], if effect clock_skew is in the
  // model: the delay is then that of the newest frame. 0: nothing is forgotten.
  double skew_walk_rtHz = 0.0;
};

// For pairs as they were selected. Pairs of far things say little of their directions, which are
// right beside many others only, so that ten times as many stay; few of them come in a second.
SlidingWindowOptions WindowOptionsFor(const PairSelection& selection,
                                      SlidingWindowOptions options = {});

enum class AddResult {
  kAccepted,
  kNotFinite,
  kNotIncreasing,  // stamp not after the one before
};

// What the window believes after one more pair of frames.
struct WindowUpdate {
  int64_t frame_stamp_ns = 0;  // second frame of the pair
  Calibration estimate;        // with covariance
  double noise_px = 0.0;
  bool settled = false;
  // Of clocks whose rates walk: how fast the delay grows. The estimate's delay is that of the
  // frame, and its effect is at zero.
  double clock_skew = 0.0;
  // Where frames have times of their own (frame_stamp_jitter): how much later the frame was taken
  // than its stamp and the estimate's delay say, with its standard deviation; and the spread of
  // that over the frames.
  double frame_offset_s = 0.0, frame_offset_sigma_s = 0.0, frame_spread_s = 0.0;
};

class SlidingWindow {
 public:
  // start: values with effects. origin_ns: gyro clock; keep it near the data.
  SlidingWindow(const Calibration& start, const Prior& prior, int64_t origin_ns,
                const SlidingWindowOptions& options);

  // Bad data are refused by the result and change nothing.
  // saturated: at the gyro's full scale; pairs that need such a sample are left out.
  [[nodiscard]] AddResult AddGyroSample(const GyroSample& sample, bool saturated = false);
  // A pair waits inside until the gyro has passed it. stamp_a may not go back.
  // Exposures in seconds, NaN if they are not known: only effects need them.
  [[nodiscard]] AddResult AddPair(int64_t stamp_a_ns, int64_t stamp_b_ns,
                                  std::vector<Match> matches,
                                  double exposure_a_s = std::numeric_limits<double>::quiet_NaN(),
                                  double exposure_b_s = std::numeric_limits<double>::quiet_NaN());

  // Called with every solved window, in order.
  void SetListener(std::function<void(const WindowUpdate&)> listener) {
    listener_ = std::move(listener);
  }

  const WindowUpdate& latest() const { return latest_; }
  int num_used_pairs() const { return num_used_; }
  int num_skipped_pairs() const { return num_skipped_; }
  // Tracks of things that move by themselves (track_lean.h), left out from when that was seen.
  int num_moving_tracks() const { return num_moving_; }
  // Windows without a result: the last good estimate stands.
  int num_failed_solves() const { return num_failed_solves_; }
  // Why the latest one has none; empty if it has.
  const std::string& failure() const { return failure_; }
  const PairGraph& graph() const { return graph_; }

 private:
  struct Pending {
    int64_t stamp_b_ns = 0;
    TimedPair pair;
  };

  static constexpr size_t kMaxPending = 300;  // pairs that wait for the gyro; then the oldest goes

  void ProcessPending();
  // The pair without what is known to move.
  void LeaveOutMoving(TimedPair* pair);
  // Looks for tracks that move among those of the window, and takes them out of it.
  void FindMoving();
  void Process(const Pending& pair);
  // Column of the skew among the effects; -1: the clocks' rates do not walk.
  int WalkingSkew() const;
  // Fills estimate and skew. Errors: kCannotEstimate.
  Status SolveWindow(const TimedPair& newest, WindowUpdate* update);
  void UpdateNoise();
  void UpdateFrameTimes();
  bool Settled(const Calibration& estimate) const;

  const SlidingWindowOptions options_;
  const int64_t origin_ns_;
  PairGraph graph_;
  std::deque<Pending> pending_;
  std::function<void(const WindowUpdate&)> listener_;
  WindowUpdate latest_;
  double last_gyro_time_s_ = -std::numeric_limits<double>::infinity();
  double last_pair_time_s_ = -std::numeric_limits<double>::infinity();
  int64_t next_pair_id_ = 0;
  int num_used_ = 0, num_skipped_ = 0, num_failed_solves_ = 0, num_moving_ = 0;
  const NoiseScale noise_scale_;
  double noise_px_ = 1.0, noise_of_pairs_px_ = 1.0;
  CrossFit cross_fit_;
  bool settled_ = false;
  FrameOffset newest_frame_;  // if frames have times of their own
  // How far tracks lean in each pair of the window, as the latest estimate has it, and in those
  // that have left it; of tracks that are still in it.
  std::map<int64_t, TrackLeans> leans_;
  TrackLeans leans_before_;
  std::map<int64_t, int64_t> moving_;  // tracks that move, and the last pair that had them
  std::string failure_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_SLIDING_WINDOW_H_
