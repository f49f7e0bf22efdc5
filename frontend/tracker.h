// Follows corners from frame to frame: pyramidal Kanade-Lucas-Tomasi on Shi-Tomasi corners.
#ifndef CAMGYRO_FRONTEND_TRACKER_H_
#define CAMGYRO_FRONTEND_TRACKER_H_

#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Where a point of the previous frame is expected in the new one [px]. A position that is not
// finite means "no idea": the search then starts at the previous position.
using PointPredictor = std::function<Eigen::Vector2d(const Eigen::Vector2d& px_previous)>;

struct TrackerOptions {
  int max_points = 200;
  // Corners are spread over grid x grid cells, each with an equal share of max_points.
  int grid = 8;
  double min_distance_px = 12.0;  // between corners at their birth
  // Weakest corner accepted, as a fraction of the strongest one's smaller eigenvalue.
  double min_quality = 0.002;
  // Side of the patch, odd. A point is followed while its whole patch lies within the image: with a
  // part of it outside, errors of up to 0.4 px were seen where the others have 0.01 px.
  int window_px = 21;
  // Motion without prediction that the pyramid must reach, as a fraction of the image width.
  double max_motion = 0.25;
  // A point tracked there and back must return to within this distance.
  double max_forward_backward_px = 0.5;
};

// Streaming tracker: one call per frame, in order.
//
// Noise model: MatchNoise::kSecondImage. Every frame re-anchors the patch where the point was found
// in the frame before, so the earlier position defines the point and the error of a consecutive
// pair sits in its second image; over n frames the errors add up (a random walk). Matching against
// the patch of birth would not drift, but its patch ages: see docs/tracker.md for the comparison.
//
// The same frames give the same tracks, bit for bit.
class KltTracker {
 public:
  explicit KltTracker(const TrackerOptions& options = {});

  // gray: 8-bit, one channel. Returns the points seen in it, by ascending track id; ids count
  // births from 0 and are never used twice. A frame that is empty, or not 8-bit grey, or of another
  // size than the one before ends every track (and the latter starts new ones).
  std::vector<TrackedPoint> Add(const cv::Mat& gray, const PointPredictor& predictor = nullptr);

 private:
  void FollowPoints(const std::vector<cv::Mat>& pyramid, const PointPredictor& predictor);
  void AddCorners(const cv::Mat& gray);

  TrackerOptions options_;
  cv::Size size_;
  std::vector<cv::Mat> pyramid_;  // of the previous frame, with derivatives
  std::vector<int64_t> ids_;      // ascending
  std::vector<cv::Point2f> points_;
  int64_t next_id_ = 0;
};

// Levels above the full image that a patch of window_px needs, to follow motion_px: each level
// reaches half a window, in its own pixels.
int PyramidLevels(int window_px, double motion_px);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TRACKER_H_
