// From pictures to tracks: the whole frontend in one call.
#ifndef CAMGYRO_FRONTEND_TRACK_RECORDING_H_
#define CAMGYRO_FRONTEND_TRACK_RECORDING_H_

#include <cstdint>
#include <functional>
#include <map>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "frontend/tracker.h"

namespace camgyro {

// The image motion that a recording has, whoever found it.
struct ImageMotion {
  size_t pairs = 0;          // of frames
  size_t total_matches = 0;  // in them
  double matches = 0.0;      // per pair, median
  double motion_px = 0.0;    // of a match, median
};
ImageMotion MeasureImageMotion(const Recording& recording);

// kCannotEstimate if there are too few matches per pair for any estimate, or nothing moves.
Status CheckImageMotion(const Recording& recording);

// A tracker may have worked on some of the frames only, as on every other one: where a third of the
// frames or more have no point in given tracks, those are left out, and counted as a fault.
void LeaveOutUntrackedFrames(Recording* recording);

// A picture of a lens cap, of the dark, of nothing but light: no corner in it is one of the scene.
// `gray`: 8-bit, one channel.
bool ShowsNothing(const cv::Mat& gray);

// Pictures for people to look at, by the stamps of their frames: 8-bit grey, scaled down.
using SmallPictures = std::map<int64_t, cv::Mat>;
cv::Mat SmallPicture(const cv::Mat& gray);  // at most 512 px wide

struct TrackingSummary {
  double outlier_ratio = 0.0;  // share of matches taken for wrong
  double seconds = 0.0;
  bool noise_adds_up = false;  // found in tracks of others (pipeline/track_noise.h)
  // A few frames in a row at 1/8, 3/8, 5/8 and 7/8 of the recording: to decode them once more, for
  // the report, takes as long as all frames where the video has a single key picture.
  SmallPictures pictures;
};

// Called with the done share 0..1.
using TrackingProgress = std::function<void(double done)>;

// Decodes all frames, follows corners, and cuts tracks where a match is wrong: the track goes on
// under a new id. Sets `tracks` (one entry per frame), `match_noise`, removes
// `matches`. Frames whose picture shows nothing, or has another size than the camera's, are left
// out, and counted in the recording's faults; tracks end at them.
//
// Without a calibration, wrong is what RejectByBinHomography rejects; with one, the gyro predicts
// where points go, and wrong is what is off its epipolar line (outliers.h).
//
// Errors of the files, among them a recording most of whose pictures have another size;
// kCannotEstimate as CheckImageMotion.
Result<TrackingSummary> TrackRecording(const TrackerOptions& options,
                                       const Calibration* calibration,
                                       const TrackingProgress& progress, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TRACK_RECORDING_H_
