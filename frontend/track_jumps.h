// Wrong points in tracks that somebody else made.
#ifndef CAMGYRO_FRONTEND_TRACK_JUMPS_H_
#define CAMGYRO_FRONTEND_TRACK_JUMPS_H_

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "core/recording.h"

namespace camgyro {

struct TrackJumps {
  size_t points = 0;  // of all tracks
  size_t off = 0;     // that were off their track, and are gone
  size_t cuts = 0;    // places where a track slipped, and goes on under a new id

  double wrong_ratio() const {
    return points > 0 ? static_cast<double>(off + cuts) / static_cast<double>(points) : 0.0;
  }
};

// Takes out of the tracks what no motion explains. From frame to frame, the picture's common motion
// (a homography) is taken out; what is left of a track's motion, parallax, changes little from one
// frame to the next. So three places tell where a point should be: the middle between its
// neighbours in time, and the lines through the two before and the two after it. A point is off its
// track if it is beyond kJumpSigmas of noise of all of those that exist, two at least: it then is a
// wrong match, and leaves. A track slips between two frames if either side contradicts the other,
// both being consistent by themselves: it then follows another corner, and gets another id from
// there on. The noise is a median over the recording, one for each kind of prediction: whatever
// bends tracks, near points or vibration, is in it. A repeated picture has no motion to compare.
//
// Needs neither lens nor gyro, and does not look at epipolar lines: what it leaves is selected by
// nothing that the estimators measure. What it cannot tell: the first and the last point of a
// track, tracks of fewer than four frames, things that move smoothly, and motion in pictures
// of less than ten tracks. Runs of wrong points longer than one frame are two slips.
constexpr double kJumpSigmas = 5.0;
TrackJumps RemoveTrackJumps(Recording* recording);

// The same of tracks that come frame by frame, without a recording: the noise is that of the
// latest kMemory frames, and a frame is known when kBehind more have come. Not thread-safe.
class StreamingTrackJumps {
 public:
  static constexpr size_t kBehind = 3;   // as far as predictions reach, and whether those are off
  static constexpr size_t kMemory = 30;  // a second of most cameras

  // The points of the next frame, by ascending id, 0 or more. Returns those of the frame kBehind
  // before it, by ascending id; none where there is no such frame. Tracks that have slipped go on
  // under ids of less than kLargestCutId.
  static constexpr int64_t kLargestCutId = -(int64_t{1} << 32);
  std::optional<std::vector<TrackedPoint>> Add(std::vector<TrackedPoint> points);

  // Frames that have been added and not returned.
  size_t held() const { return std::min(frames_.size(), kBehind); }
  const TrackJumps& jumps() const { return jumps_; }  // so far

 private:
  struct Frame {
    std::vector<TrackedPoint> points, kept;        // as they came; without those that are off
    std::optional<Eigen::Matrix3d> motion;         // to the next frame
    std::array<std::vector<double>, 3> deviation;  // of every point, by kind of prediction
  };

  std::deque<Frame> frames_;
  std::map<int64_t, int64_t> renamed_;  // tracks that have slipped and are still seen
  int64_t next_id_ = std::numeric_limits<int64_t>::min();
  TrackJumps jumps_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TRACK_JUMPS_H_
