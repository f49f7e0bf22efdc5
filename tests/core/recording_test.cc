#include "core/recording.h"

#include <gmock/gmock.h>

namespace camgyro {
namespace {

TEST(Recording, PairsHoldTheTracksSeenInBothFrames) {
  const std::vector<std::vector<TrackedPoint>> tracks = {
      {{1, {10, 11}}, {3, {30, 31}}, {7, {70, 71}}},
      {{3, {32, 33}}, {8, {80, 81}}},
      {{1, {12, 13}}, {3, {34, 35}}, {8, {82, 83}}},
  };
  const auto neighbours = PairsFromTracks(tracks, 1);
  ASSERT_EQ(neighbours.size(), 2u);
  ASSERT_EQ(neighbours[0].matches.size(), 1u);
  EXPECT_EQ(neighbours[0].matches[0].px_a, Eigen::Vector2d(30, 31));
  EXPECT_EQ(neighbours[0].matches[0].px_b, Eigen::Vector2d(32, 33));
  EXPECT_EQ(neighbours[1].matches.size(), 2u);
  const auto skipping = PairsFromTracks(tracks, 2);
  ASSERT_EQ(skipping.size(), 1u);
  EXPECT_EQ(skipping[0].frame_b, 2);
  EXPECT_EQ(skipping[0].matches.size(), 2u);
  EXPECT_TRUE(PairsFromTracks(tracks, 3).empty());
}

TEST(Recording, MedianIntervalIgnoresAGap) {
  std::vector<Frame> frames(5);
  const int64_t stamps[] = {0, 33'000'000, 66'000'000, 1'000'000'000, 1'033'000'000};
  for (int i = 0; i < 5; ++i) frames[i].stamp_ns = stamps[i];
  EXPECT_NEAR(MedianInterval(frames), 0.033, 1e-12);
  EXPECT_EQ(MedianInterval(std::vector<Frame>(1)), 0.0);
}

}  // namespace
}  // namespace camgyro
