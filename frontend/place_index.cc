#include "frontend/place_index.h"

#include <algorithm>
#include <cmath>
#include <opencv2/flann.hpp>

namespace camgyro {
namespace {

constexpr int kCorners = 500;
// Side of the patch that ORB describes [px]; points nearer to the border than this have none.
constexpr int kPatchPx = 31;
// Descriptors of one point differ by so many of their 256 bits at most: TH_LOW of ORB-SLAM (Mur-
// Artal et al. 2015).
constexpr int kMostBits = 50;
// A camera that looks up or down more steeply than acos of this has no upright picture.
constexpr double kLeastUpright = 0.2;
constexpr size_t kShelf = 32;
// Neighbouring pictures of one walk show the same: that many share the votes of a point.
constexpr int kNearest = 3;
// Of the hashing: tables, bits of a key, and how many bits of a key may differ (FLANN's manual
// recommends 12, 20, 2 for long lists; shelves are short).
constexpr int kTables = 6, kKeyBits = 12, kProbeLevel = 1;

cv::KeyPoint KeyPointAt(const Eigen::Vector2d& px, float angle_deg, int index) {
  return {static_cast<float>(px.x()),
          static_cast<float>(px.y()),
          static_cast<float>(kPatchPx),
          angle_deg,
          /*response=*/0.0f,
          /*octave=*/0,
          index};
}

}  // namespace

PictureFeatures DescribePicture(const cv::Mat& gray, const std::vector<TrackedPoint>& tracks,
                                const Eigen::Vector3d& down_cam) {
  PictureFeatures features;
  const Eigen::Vector3d down = down_cam.normalized();
  if (down.head<2>().norm() < kLeastUpright) return features;
  // 0 for a level camera, whose patches are then as they are.
  const double turn_rad = std::atan2(-down.x(), down.y());
  const auto angle_deg = static_cast<float>(std::fmod(turn_rad * 180.0 / M_PI + 360.0, 360.0));
  const auto orb = cv::ORB::create(kCorners);
  std::vector<cv::KeyPoint> points;
  orb->detect(gray, points);
  for (cv::KeyPoint& point : points) point.angle = angle_deg;
  orb->compute(gray, points, features.corners);
  for (const cv::KeyPoint& point : points) features.corners_px.emplace_back(point.pt.x, point.pt.y);
  points.clear();
  for (size_t i = 0; i < tracks.size(); ++i) {
    points.push_back(KeyPointAt(tracks[i].px, angle_deg, static_cast<int>(i)));
  }
  orb->compute(gray, points, features.tracks);  // leaves out those at the border
  for (const cv::KeyPoint& point : points) {
    const TrackedPoint& track = tracks[static_cast<size_t>(point.class_id)];
    features.track_ids.push_back(track.track_id);
    features.tracks_px.push_back(track.px);
  }
  return features;
}

std::vector<DescriptorMatch> MatchDescriptors(const cv::Mat& a, const cv::Mat& b) {
  std::vector<DescriptorMatch> result;
  if (a.empty() || b.empty()) return result;
  std::vector<cv::DMatch> matches;
  cv::BFMatcher(cv::NORM_HAMMING, /*crossCheck=*/true).match(a, b, matches);
  for (const cv::DMatch& match : matches) {
    if (match.distance <= kMostBits) result.push_back({match.queryIdx, match.trainIdx});
  }
  return result;
}

struct PlaceIndex::Shelf {
  cv::FlannBasedMatcher matcher{
      cv::makePtr<cv::flann::LshIndexParams>(kTables, kKeyBits, kProbeLevel)};
};

PlaceIndex::PlaceIndex() = default;
PlaceIndex::~PlaceIndex() = default;

void PlaceIndex::Add(const cv::Mat& descriptors) {
  waiting_.push_back(descriptors);
  if (waiting_.size() < kShelf) return;
  auto shelf = std::make_unique<Shelf>();
  shelf->matcher.add(waiting_);
  // The hashing draws its bits from OpenCV's generator of this thread.
  const uint64_t state = cv::theRNG().state;
  cv::theRNG().state = 1 + shelves_.size();
  const bool has_any = std::any_of(waiting_.begin(), waiting_.end(),
                                   [](const cv::Mat& place) { return !place.empty(); });
  if (has_any) shelf->matcher.train();
  cv::theRNG().state = state;
  shelves_.push_back(has_any ? std::move(shelf) : nullptr);
  waiting_.clear();
}

std::vector<PlaceVotes> PlaceIndex::Query(const cv::Mat& descriptors, size_t end, int least) {
  std::vector<PlaceVotes> result;
  if (descriptors.empty()) return result;
  for (size_t s = 0; s < shelves_.size() && s * kShelf < end; ++s) {
    if (!shelves_[s]) continue;
    std::vector<std::vector<cv::DMatch>> nearest;
    shelves_[s]->matcher.knnMatch(descriptors, nearest, kNearest);
    std::vector<int> votes(kShelf, 0);
    for (const auto& matches : nearest) {
      for (const cv::DMatch& match : matches) {
        if (match.distance <= kMostBits) ++votes[static_cast<size_t>(match.imgIdx)];
      }
    }
    for (size_t i = 0; i < kShelf && s * kShelf + i < end; ++i) {
      if (votes[i] >= least) result.push_back({s * kShelf + i, votes[i]});
    }
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const PlaceVotes& a, const PlaceVotes& b) { return a.votes > b.votes; });
  return result;
}

}  // namespace camgyro
