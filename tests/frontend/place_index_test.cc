#include "frontend/place_index.h"

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

namespace camgyro {
namespace {

using testing::Field;
using testing::Not;

// A picture of rectangles, another one for every number.
cv::Mat Place(int number) {
  cv::RNG random(1000 + static_cast<uint64_t>(number));
  cv::Mat picture(240, 320, CV_8U, cv::Scalar(128));
  for (int i = 0; i < 150; ++i) {
    const int u = random.uniform(-20, 320), v = random.uniform(-20, 240);
    const int width = random.uniform(6, 50), height = random.uniform(6, 50);
    cv::rectangle(picture, cv::Rect(u, v, width, height), cv::Scalar(random.uniform(0, 256)),
                  cv::FILLED);
  }
  cv::GaussianBlur(picture, picture, cv::Size(3, 3), 0.8);
  return picture;
}

// The same from a little to the side, darker and with noise.
cv::Mat Again(const cv::Mat& place, double turn_rad = 0.0) {
  cv::Mat M = cv::getRotationMatrix2D(cv::Point2f(160.0f, 120.0f), -turn_rad * 180.0 / M_PI, 1.03);
  M.at<double>(0, 2) += 9.0;
  M.at<double>(1, 2) -= 5.0;
  cv::Mat seen, noise(place.size(), CV_16S);
  cv::warpAffine(place, seen, M, place.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  cv::theRNG().state = 5;
  cv::randn(noise, 0.0, 3.0);
  seen.convertTo(seen, CV_16S, 0.9, 4.0);
  seen += noise;
  seen.convertTo(seen, CV_8U);
  return seen;
}

const Eigen::Vector3d kLevel(0.0, 1.0, 0.0);

std::vector<TrackedPoint> CornersOf(const cv::Mat& gray) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(gray, corners, 80, 0.01, 10.0);
  std::vector<TrackedPoint> tracks;
  for (const cv::Point2f& corner : corners) {
    tracks.push_back({static_cast<int64_t>(tracks.size()), {corner.x, corner.y}});
  }
  return tracks;
}

TEST(PlaceIndex, FindsThePlaceAmongMany) {
  PlaceIndex index;
  constexpr int kPlaces = 96;
  for (int i = 0; i < kPlaces; ++i) index.Add(DescribePicture(Place(i), {}, kLevel).corners);
  for (const int place : {3, 40, 77}) {
    const cv::Mat seen = Again(Place(place));
    const PictureFeatures features = DescribePicture(seen, CornersOf(seen), kLevel);
    const auto found = index.Query(features.tracks, kPlaces, 1);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].place, static_cast<size_t>(place));
    EXPECT_GT(found[0].votes, 10);
    const int next = found.size() > 1 ? found[1].votes : 0;
    EXPECT_GT(found[0].votes, 3 * next);
    // Not before it was there.
    EXPECT_THAT(index.Query(features.tracks, static_cast<size_t>(place), 1),
                Not(testing::Contains(Field(&PlaceVotes::place, static_cast<size_t>(place)))));
  }
  EXPECT_TRUE(index.Query({}, kPlaces, 1).empty());
}

TEST(PlaceIndex, SamePlacesSameVotes) {
  const PictureFeatures seen = DescribePicture(Again(Place(9)), {}, kLevel);
  std::vector<PlaceVotes> first;
  for (const uint64_t state : {11u, 12u}) {
    PlaceIndex index;
    cv::theRNG().state = state;  // whatever others have drawn
    for (int i = 0; i < 32; ++i) index.Add(DescribePicture(Place(i), {}, kLevel).corners);
    const auto votes = index.Query(seen.corners, 32, 1);
    if (first.empty()) first = votes;
    ASSERT_EQ(votes.size(), first.size());
    for (size_t i = 0; i < votes.size(); ++i) {
      EXPECT_EQ(votes[i].place, first[i].place);
      EXPECT_EQ(votes[i].votes, first[i].votes);
    }
  }
}

// Tracked points are found among the corners of the same place, at the right pixels, also by a
// camera that is rolled: gravity says by how much.
TEST(DescribePicture, TracksAreFoundAmongCornersOfARolledCamera) {
  const cv::Mat place = Place(5);
  for (const double roll_rad : {0.0, 0.7, -2.5}) {
    SCOPED_TRACE(roll_rad);
    const PictureFeatures old = DescribePicture(place, {}, kLevel);
    const cv::Mat seen = Again(place, roll_rad);
    // A picture turned clockwise (x to y) by roll shows what is below on the left.
    const Eigen::Vector3d down(-std::sin(roll_rad), std::cos(roll_rad), 0.0);
    const PictureFeatures now = DescribePicture(seen, CornersOf(seen), down);
    const auto matches = MatchDescriptors(now.tracks, old.corners);
    ASSERT_GT(matches.size(), 15u);
    size_t right = 0;
    for (const DescriptorMatch& match : matches) {
      const Eigen::Vector2d from =
          old.corners_px[static_cast<size_t>(match.b)] - Eigen::Vector2d(160.0, 120.0);
      const Eigen::Vector2d to =
          1.03 * Eigen::Vector2d(std::cos(roll_rad) * from.x() - std::sin(roll_rad) * from.y(),
                                 std::sin(roll_rad) * from.x() + std::cos(roll_rad) * from.y()) +
          Eigen::Vector2d(169.0, 115.0);
      right += (to - now.tracks_px[static_cast<size_t>(match.a)]).norm() < 3.0;
    }
    EXPECT_GT(right, 7 * matches.size() / 10);
  }
}

TEST(DescribePicture, LooksForNothingWhereNothingIsUpright) {
  const cv::Mat place = Place(1);
  const auto tracks = CornersOf(place);
  EXPECT_TRUE(DescribePicture(place, tracks, {0.05, 0.05, 1.0}).corners.empty());
  const PictureFeatures features = DescribePicture(place, tracks, kLevel);
  EXPECT_EQ(features.track_ids.size(), static_cast<size_t>(features.tracks.rows));
  EXPECT_EQ(features.corners_px.size(), static_cast<size_t>(features.corners.rows));
  // Nobody describes what is at the border.
  EXPECT_LT(features.track_ids.size(), tracks.size());
  EXPECT_EQ(std::set<int64_t>(features.track_ids.begin(), features.track_ids.end()).size(),
            features.track_ids.size());
}

}  // namespace
}  // namespace camgyro
