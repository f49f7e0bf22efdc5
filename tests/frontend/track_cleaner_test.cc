#include "frontend/track_cleaner.h"

#include <gmock/gmock.h>

namespace camgyro {
namespace {

// A grid of 8 x 6 points that moves by (3, 1) px per frame.
std::vector<TrackedPoint> Grid(int frame) {
  std::vector<TrackedPoint> points;
  for (int i = 0; i < 48; ++i) {
    points.push_back({i, {40.0 + 75.0 * (i % 8) + 3.0 * frame, 40.0 + 75.0 * (i / 8) + frame}});
  }
  return points;
}

std::vector<int64_t> Ids(const std::vector<TrackedPoint>& points) {
  std::vector<int64_t> ids;
  for (const TrackedPoint& point : points) ids.push_back(point.track_id);
  return ids;
}

TEST(TrackCleaner, ATrackGoesOnUnderANewIdFromAWrongMatchOn) {
  TrackCleaner cleaner(640, 480, 1000);
  const std::vector<int64_t> all = Ids(Grid(0));
  EXPECT_EQ(Ids(cleaner.Add(Grid(0))), all);
  EXPECT_EQ(Ids(cleaner.Add(Grid(1))), all);
  // Track 19 slips to another corner, and stays on it.
  const Eigen::Vector2d slip(25.0, -20.0);
  for (int frame = 2; frame < 5; ++frame) {
    std::vector<TrackedPoint> points = Grid(frame);
    points[19].px += slip;
    const std::vector<TrackedPoint> cleaned = cleaner.Add(points);
    ASSERT_EQ(cleaned.size(), 48u);
    // By ascending id: the new one is last, where the slipped point is.
    EXPECT_EQ(cleaned.back().track_id, 1000) << frame;
    EXPECT_EQ(cleaned.back().px, points[19].px);
    EXPECT_EQ(cleaned[19].track_id, 20);
  }
  EXPECT_DOUBLE_EQ(cleaner.wrong_ratio(), 1.0 / (4 * 48));
  // Slipping back is wrong again.
  EXPECT_EQ(cleaner.Add(Grid(5)).back().track_id, 1001);
  // Once lost, the tracker's id is not ours any more.
  std::vector<TrackedPoint> without = Grid(6);
  without.erase(without.begin() + 19);
  EXPECT_EQ(cleaner.Add(without).back().track_id, 47);
}

}  // namespace
}  // namespace camgyro
