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
  // Side of the patch that KLT searches, and of the one that is aligned then (AlignPatch), odd. A
  // point is followed while both lie within the image: with a part of the first outside, errors of
  // up to 0.4 px were seen where the others have 0.01 px.
  int window_px = 21;
  int aligned_px = 31;
  // Motion without prediction that the pyramid must reach, as a fraction of the image width.
  double max_motion = 0.25;
  // A point tracked there and back must return to within this distance. Distances seen (median,
  // 90 %; KLT's steps down to 0.005 px): 0.002, 0.012 px on euroc-v101-flight; 0.009, 0.26 px on
  // phone-cc9-street.
  double max_forward_backward_px = 0.5;
};

// Streaming tracker: one call per frame, in order.
//
// Noise model: MatchNoise::kSecondImage. Every frame re-anchors the patch where the point was found
// in the frame before, so the earlier position defines the point and the error of a consecutive
// pair sits in its second image; over n frames the errors add up (a random walk). Matching against
// the patch of birth would not drift, but its patch ages. Measured, a chain of frame-to-frame steps
// against one direct step, per axis: 2 steps 0.004 px (median), 0.02 px (90 %) on
// euroc-v101-flight, 0.009 and 0.16 px on phone-cc9-street; 4 steps 0.007, 0.03 and 0.02, 0.32 px.
//
// Where a patch is, KLT finds and AlignPatch decides: KLT takes one that turns or grows for one
// that moves, towards where its texture is. Measured against the truth of a rendered video
// (tools/scenarios/video_room.yaml seed=1; a throw-away program, no command), frame to frame: 0.083
// px along x and 0.070 px along y by KLT alone, correlated by 0.5 with the same point's error two
// frames later; 0.038 and 0.033 px, correlated by 0.2, with it. OpenCV's findTransformECC is as
// good (0.046 and 0.040 px, both with patches of 21 px), but takes ten times the time.
//
// Corners are looked for at half the size, where KLT works, too: they decide which points are
// followed, not where they are. KLT looks first near where a point's own last motion leads it, and
// only for what is lost there in the whole pyramid.
//
// How the noise lies (TrackedPoint::noise_factor): the covariance of the alignment, over that of
// the typical corner in the first pair of frames. Motion blur makes the noise along the motion up
// to twice as large as across; taken for alike, it shifts f by 0.2 to 0.3 % (five sigmas).
//
// Exposure: where the points show that it changed, what is lost is searched once more with the
// brightness of the frame before, if the first search finds 20. With every other frame 20 % darker,
// 98.5 % of the points survive a frame on euroc-v101-flight (73 % without; 99 % unchanged) and 86.5
// % on phone-cc9-street (64 %; 89 %). Mean and contrast of whole frames do not serve: they change
// with large motion. CLAHE moves points by 0.025 px (median) where the exposure does not change at
// all.
//
// The same frames give the same tracks, bit for bit.
class KltTracker {
 public:
  explicit KltTracker(const TrackerOptions& options = {});

  // gray: 8-bit, one channel. Returns the points seen in it, by ascending track id; ids count
  // births from 0 and are never used twice. A frame that is empty, or not 8-bit grey, or of another
  // size than the one before ends every track (and the latter starts new ones).
  std::vector<TrackedPoint> Add(const cv::Mat& gray, const PointPredictor& predictor = nullptr);

  // What can be made of a picture before the one before it has been added: as in
  // Add(Prepare(gray)), but from another thread. It shares the memory of `gray`.
  struct Picture {
    cv::Mat gray;
    std::vector<cv::Mat> pyramid;  // of its half and what is above, each with derivatives
  };
  Picture Prepare(cv::Mat gray) const;
  std::vector<TrackedPoint> Add(Picture picture, const PointPredictor& predictor = nullptr);

 private:
  struct Search {
    std::vector<cv::Point2f> points;  // where each of points_ is now
    std::vector<bool> found;          // there and back, with the whole patch inside
  };
  std::vector<cv::Mat> Pyramid(const cv::Mat& gray) const;
  // Where the motion of the last frame leads each of points_, or that of its neighbour.
  std::vector<cv::Point2f> Expected() const;
  // Those of points_ that `which` names, there and back.
  void SearchPoints(const std::vector<cv::Mat>& pyramid, int levels,
                    const std::vector<size_t>& which, const std::vector<cv::Point2f>& start,
                    Search* search) const;
  // Those of points_ that have not been found: first near the expected place, then, what is not
  // there, from `start` in the whole pyramid.
  void SearchLost(const std::vector<cv::Mat>& pyramid, const std::vector<cv::Point2f>& start,
                  const std::vector<cv::Point2f>& expected, Search* search) const;
  void FollowPoints(const Picture& picture, const PointPredictor& predictor);
  std::vector<Eigen::Vector3d> NoiseFactors(const std::vector<Eigen::Matrix2d>& covariances);
  void AddCorners();

  TrackerOptions options_;
  cv::Size size_;
  Picture previous_;
  cv::Mat rests_;             // of each cell: frames for which it is not searched for corners
  std::vector<int64_t> ids_;  // ascending
  std::vector<cv::Point2f> points_;
  std::vector<cv::Point2f> motions_;  // from the frame before, of the first ones of points_
  std::vector<Eigen::Vector3d> noise_factors_;
  double reference_ = 0.0;  // variance of the typical corner in the first pair of frames
  int64_t next_id_ = 0;
};

// Levels above the full image that a patch of window_px needs, to follow motion_px: each level
// reaches half a window, in its own pixels.
int PyramidLevels(int window_px, double motion_px);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TRACKER_H_
