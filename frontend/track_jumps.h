// Wrong points in tracks that somebody else made.
#ifndef CAMGYRO_FRONTEND_TRACK_JUMPS_H_
#define CAMGYRO_FRONTEND_TRACK_JUMPS_H_

#include <cstddef>

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
// bends tracks, near points or vibration, is in it.
//
// Needs neither lens nor gyro, and does not look at epipolar lines: what it leaves is selected by
// nothing that the estimators measure. What it cannot tell: the first and the last point of a
// track, tracks of fewer than four frames, things that move smoothly, and motion in pictures
// of less than ten tracks. Runs of wrong points longer than one frame are two slips.
constexpr double kJumpSigmas = 5.0;
TrackJumps RemoveTrackJumps(Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TRACK_JUMPS_H_
