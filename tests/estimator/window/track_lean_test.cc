#include "estimator/window/track_lean.h"

#include <gmock/gmock.h>

#include <random>
#include <vector>

namespace camgyro {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Sums that are added up part by part are those of all, and what is left out is forgotten.
TEST(TrackLeans, AddUpInAnyParts) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  TrackLeans all, first, second;
  for (int i = 0; i < 200; ++i) {
    const int64_t track_id = i % 20;
    const double sigmas = normal(generator);
    const Eigen::Vector2d across{normal(generator), normal(generator)};
    all.Add(track_id, sigmas, across);
    (i < 90 ? first : second).Add(track_id, sigmas, across);
  }
  all.Add(Match::kNoTrack, 3.0, Eigen::Vector2d::UnitX());  // of nobody
  first.Add(second);
  ASSERT_EQ(all.All().size(), 20u);
  for (size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(first.All()[i].matches, 10);
    EXPECT_NEAR(first.All()[i].chi2, all.All()[i].chi2, 1e-9 * all.All()[i].chi2);
  }
  TrackLeans few;
  for (const int64_t track_id : {3, 7}) few.Add(track_id, 1.0, Eigen::Vector2d::UnitX());
  all.KeepOnly(few);
  EXPECT_EQ(all.All().size(), 2u);
}

TEST(MovingTracks, AreNotWhatTheModelMakesOfAll) {
  std::mt19937 generator(2);
  std::exponential_distribution<double> half_chi2(1.0);
  std::vector<TrackLean> leans;
  for (int i = 0; i < 1000; ++i) leans.push_back({i, 20, 2.0 * half_chi2(generator)});
  EXPECT_THAT(MovingTracks(leans), IsEmpty());
  for (TrackLean& lean : leans) lean.chi2 *= 6.0;  // all of them, as of an undeclared effect
  EXPECT_THAT(MovingTracks(leans), IsEmpty());
  leans[17].chi2 = leans[400].chi2 = 300.0;
  EXPECT_THAT(MovingTracks(leans), ElementsAre(17, 400));
  for (size_t i = 0; i < 600; ++i) leans[i].chi2 = 1e4;
  EXPECT_THAT(MovingTracks(leans), IsEmpty());
  EXPECT_THAT(MovingTracks({}), IsEmpty());
}

TEST(EraseMatchesOf, LeavesTheOthersInTheirOrder) {
  std::vector<Match> matches(5);
  for (size_t i = 0; i < 5; ++i) matches[i].track_id = static_cast<int64_t>(10 * i);
  EraseMatchesOf({10, 15, 40}, &matches);
  ASSERT_EQ(matches.size(), 3u);
  EXPECT_EQ(matches[0].track_id, 0);
  EXPECT_EQ(matches[1].track_id, 20);
  EXPECT_EQ(matches[2].track_id, 30);
}

}  // namespace
}  // namespace camgyro
