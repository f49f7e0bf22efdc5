// Places that a camera has been at: which old pictures show what a new one shows.
#ifndef CAMGYRO_FRONTEND_PLACE_INDEX_H_
#define CAMGYRO_FRONTEND_PLACE_INDEX_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Upright ORB descriptors (Rublee et al. 2011: oriented FAST, rotated BRIEF) of a picture, 32 bytes
// a row. They are turned by gravity, which an odometry knows, and not by the patch.
struct PictureFeatures {
  std::vector<Eigen::Vector2d> corners_px;  // FAST corners anywhere in the picture, on a pyramid
  cv::Mat corners;
  std::vector<int64_t> track_ids;  // tracked points far enough from the border
  std::vector<Eigen::Vector2d> tracks_px;
  cv::Mat tracks;
};

// `gray`: 8-bit. `down_cam`: gravity in the camera frame (x right, y down, z forward). Without any
// feature if the camera looks so steeply up or down that the picture has no upright.
PictureFeatures DescribePicture(const cv::Mat& gray, const std::vector<TrackedPoint>& tracks,
                                const Eigen::Vector3d& down_cam);

// Pairs of rows of a and b that are each other's nearest, and near. By row of a.
struct DescriptorMatch {
  int a = 0, b = 0;
};
std::vector<DescriptorMatch> MatchDescriptors(const cv::Mat& a, const cv::Mat& b);

struct PlaceVotes {
  size_t place = 0;
  int votes = 0;
};

// Descriptors of places in shelves of 32, each with locality-sensitive hashing (FLANN's, Lv et al.
// 2007). Every descriptor of a picture votes for the places with the nearest descriptors of each
// shelf. There is no vocabulary to be trained and shipped, and nothing that looks unlike what it
// was trained with. The same places in the same order give the same votes.
class PlaceIndex {
 public:
  PlaceIndex();
  ~PlaceIndex();
  PlaceIndex(const PlaceIndex&) = delete;
  PlaceIndex& operator=(const PlaceIndex&) = delete;

  // The next place; they are counted from 0.
  void Add(const cv::Mat& descriptors);
  // Places before `end` of full shelves, by falling votes; the earlier first where they are equal.
  // Places with fewer votes than `least` are left out.
  std::vector<PlaceVotes> Query(const cv::Mat& descriptors, size_t end, int least);

 private:
  struct Shelf;
  std::vector<std::unique_ptr<Shelf>> shelves_;
  std::vector<cv::Mat> waiting_;  // for their shelf to be full
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_PLACE_INDEX_H_
