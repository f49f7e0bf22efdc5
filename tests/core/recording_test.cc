#include "core/recording.h"

#include <gmock/gmock.h>

#include <cmath>

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

TEST(Recording, MatchesAreCountedAsTheyAreMade) {
  const std::vector<TrackedPoint> a = {{1, {10, 11}}, {3, {30, 31}}, {7, {70, 71}}};
  const std::vector<TrackedPoint> b = {{3, {32, 33}}, {7, {72, 73}}, {8, {80, 81}}};
  EXPECT_EQ(CountMatches(a, b), 2u);
  EXPECT_EQ(CountMatches(a, b), MatchesBetween(a, b).size());
  EXPECT_EQ(CountMatches(a, {}), 0u);
}

// The noise factor is kept with 11 bits; what has none is exact.
TEST(Recording, NoiseOfAPointIsRoundedToAThousandth) {
  const TrackedPoint plain(4, {1.0, 2.0});
  EXPECT_EQ(plain.noise_factor.cast<double>(), Eigen::Vector3d(1.0, 0.0, 1.0));
  const Eigen::Vector3d factor(1.3331, -0.4012, 0.7077);
  const TrackedPoint point(4, {1.0, 2.0}, factor);
  const std::vector<Match> matches = MatchesBetween({plain}, {point});
  ASSERT_EQ(matches.size(), 1u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(matches[0].noise_factor_b[i], factor[i], std::abs(factor[i]) / 2048.0);
  }
}

TEST(Recording, FramesAreLeftOutWithAllThatTheyHave) {
  Recording whole;
  for (int i = 0; i < 5; ++i) {
    whole.frames.emplace_back().stamp_ns = 10 * i;
    whole.tracks.push_back({{i, {0.0, 0.0}}});
    whole.q_cam_world.emplace_back(1.0, i, 0.0, 0.0);
    if (i > 0) whole.matches.push_back({i - 1, i, {{{0.0, 0.0}, {1.0 * i, 0.0}}}});
  }
  Recording recording = whole;
  LeaveOutFrames({1, 4}, /*repeats=*/false, &recording);
  ASSERT_EQ(recording.frames.size(), 3u);
  const size_t pictures[] = {0, 2, 3};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(recording.PictureOf(i), pictures[i]);
    EXPECT_EQ(recording.frames[i].stamp_ns, whole.frames[pictures[i]].stamp_ns);
    EXPECT_EQ(recording.tracks[i][0].track_id, static_cast<int64_t>(pictures[i]));
    EXPECT_EQ(recording.q_cam_world[i].x(), static_cast<double>(pictures[i]));
  }
  ASSERT_EQ(recording.matches.size(), 1u);  // of the frames 2 and 3
  EXPECT_EQ(recording.matches[0].frame_a, 1);
  EXPECT_EQ(recording.matches[0].frame_b, 2);

  LeaveOutFrames({1}, /*repeats=*/true, &recording);  // counts on from what is left
  ASSERT_EQ(recording.frames.size(), 2u);
  EXPECT_EQ(recording.PictureOf(1), 3u);
  ASSERT_EQ(recording.matches.size(), 1u);  // the frame before has the picture, too
  EXPECT_EQ(recording.matches[0].frame_a, 0);
  EXPECT_EQ(recording.matches[0].frame_b, 1);
  EXPECT_EQ(recording.matches[0].matches[0].px_b.x(), 3.0);
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
