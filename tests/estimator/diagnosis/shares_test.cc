#include "estimator/diagnosis/shares.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "estimator/diagnosis/thresholds.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

Recording Tracks(double mean_life_frames) {
  simulation::Scenario scenario;
  scenario.duration_s = 30.0;
  scenario.tracks.count = 40;
  scenario.tracks.mean_life_frames = mean_life_frames;
  auto simulated = simulation::SimulateTracks(scenario);
  EXPECT_TRUE(simulated);
  return std::move(simulated->recording);
}

Recording Moving(simulation::MotionKind kind, double duration_s) {
  simulation::Scenario scenario;
  scenario.duration_s = duration_s;
  scenario.motion = simulation::MotionPreset(kind);
  auto simulated = simulation::SimulateTracks(scenario);
  EXPECT_TRUE(simulated);
  return std::move(simulated->recording);
}

// As many pairs of a fast camera as of one of 60 frames/s, and no observation twice.
TEST(SelectPairsToTest, AreNoMoreOfFastCameras) {
  for (const double rate_hz : {30.0, 60.0, 240.0}) {
    simulation::Scenario scenario;
    scenario.duration_s = 8.0;
    scenario.camera.rate_hz = rate_hz;
    scenario.camera.readout_s = 0.004;
    scenario.tracks.count = 20;
    Recording recording = simulation::SimulateTracks(scenario)->recording;
    const PairSelection selection = SelectPairsToTest(recording);
    EXPECT_EQ(selection.gap, SelectPairs(recording).gap);
    EXPECT_NEAR(rate_hz / selection.stride, std::min(0.5 * rate_hz, 30.0), 0.1);
    std::set<int> seen;
    for (const TimedPair& pair : MakeEstimationInput(recording, selection).pairs) {
      EXPECT_TRUE(seen.insert(pair.frame_a).second && seen.insert(pair.frame_b).second);
    }
    recording.match_noise = MatchNoise::kSecondImage;  // one after the other
    EXPECT_EQ(SelectPairsToTest(recording).stride, SelectPairs(recording).stride);
  }
}

std::set<int> Frames(const std::vector<PairBlock>& blocks) {
  std::set<int> frames;
  for (const TimedPair& pair : Joined(blocks)) frames.insert({pair.frame_a, pair.frame_b});
  return frames;
}

TEST(Shares, NoFrameIsInTwoShares) {
  const Recording recording = Tracks(15.0);
  const Shares shares = MakeShares(recording, MakeEstimationInput(recording));
  const std::set<int> fit = Frames(shares.fit), choice = Frames(shares.choice),
                      report = Frames(shares.report);
  EXPECT_GT(fit.size(), 300u);
  EXPECT_GT(choice.size(), 300u);
  EXPECT_GT(report.size(), 120u);
  std::set<int> all = fit;
  all.insert(choice.begin(), choice.end());
  all.insert(report.begin(), report.end());
  EXPECT_EQ(all.size(), fit.size() + choice.size() + report.size());
}

TEST(Shares, WithoutReportTheOthersAreTheSame) {
  const Recording recording = Tracks(15.0);
  const EstimationInput input = OutlineOf(recording);
  const Shares all = MakeShares(recording, input);
  const Shares without = MakeShares(recording, input, {100, 100, 50, false});
  EXPECT_TRUE(without.report.empty());
  EXPECT_EQ(without.fit.size(), all.fit.size());
  EXPECT_EQ(without.choice.size(), all.choice.size());
  EXPECT_LE(Joined(without.fit).size(), 100u);
  EXPECT_FALSE(without.fit.front().front().matches.empty());
}

// Every n-th pair of those that would be there, with the tracks that the other shares do not see.
TEST(Shares, AreThinned) {
  const Recording recording = Tracks(15.0);
  const EstimationInput input = OutlineOf(recording);
  const std::vector<TimedPair> all = Joined(MakeShares(recording, input).report);
  ASSERT_GT(all.size(), 20u);
  const Shares shares = MakeShares(recording, input, {100, 100, 20});
  const std::vector<TimedPair> report = Joined(shares.report);
  EXPECT_LE(report.size(), 20u);
  EXPECT_GE(report.size(), 10u);
  EXPECT_FALSE(shares.report_shares_tracks);
  const size_t stride = (all.size() + 19) / 20;
  for (size_t i = 0; i < report.size(); ++i) {
    EXPECT_EQ(report[i].frame_a, all[i * stride].frame_a);
    EXPECT_EQ(report[i].matches.size(), all[i * stride].matches.size());
  }
}

// Each holds scores of all candidates: an hour has no more than a quarter of it.
TEST(Shares, HaveNoMoreBlocksInAnHour) {
  Recording recording;
  EstimationInput input;
  for (int i = 0; i < 36000; ++i) {
    recording.frames.emplace_back().stamp_ns = static_cast<int64_t>(i) * 100'000'000;
    if (i == 0) continue;
    TimedPair pair;
    pair.frame_a = i - 1;
    pair.frame_b = i;
    pair.time_a_s = 0.1 * pair.frame_a;
    pair.time_b_s = 0.1 * pair.frame_b;
    input.pairs.push_back(pair);
  }
  recording.tracks.resize(recording.frames.size());
  const Shares shares = MakeShares(recording, input);
  EXPECT_NEAR(shares.block_s, 12.0, 0.01);
  const size_t blocks = shares.fit.size() + shares.choice.size() + shares.report.size();
  EXPECT_LE(blocks, 300u);
  EXPECT_GT(blocks, 290u);
}

// Of a turn on the spot, pairs are long (SelectPairs), and stretches, too: half of the pairs stay.
TEST(Shares, HaveRoomForLongPairs) {
  const Recording recording = Moving(simulation::MotionKind::kRotation, 14.0);
  const PairSelection selection = SelectPairs(recording);
  const double pair_s = selection.gap * MedianInterval(recording.frames);
  ASSERT_GT(pair_s, kLeastFramesOfBlock * MedianInterval(recording.frames));
  const EstimationInput input = OutlineOf(recording, selection);
  const Shares shares = MakeShares(recording, input);
  EXPECT_GE(shares.block_s, 2.0 * pair_s);
  EXPECT_GT(Joined(shares.fit).size(), 40u);
  EXPECT_GT(Joined(shares.choice).size(), 40u);
  // Pairs of another gap have the same stretches.
  EXPECT_EQ(MakeShares(recording, OutlineOf(recording)).block_s, shares.block_s);
}

TEST(Shares, NoTrackOfTheReportIsInAnotherShare) {
  const Recording recording = Tracks(15.0);
  const Shares shares = MakeShares(recording, MakeEstimationInput(recording));
  ASSERT_FALSE(shares.report_shares_tracks);
  // Tracks by where they are in which frame.
  const auto key = [](int frame, const Eigen::Vector2d& px) {
    return std::make_tuple(frame, px.x(), px.y());
  };
  std::map<std::tuple<int, double, double>, int64_t> id;
  for (size_t f = 0; f < recording.tracks.size(); ++f) {
    for (const TrackedPoint& point : recording.tracks[f]) {
      id[key(static_cast<int>(f), point.px)] = point.track_id;
    }
  }
  const auto tracks = [&](const std::vector<PairBlock>& blocks) {
    std::set<int64_t> seen;
    for (const TimedPair& pair : Joined(blocks)) {
      for (const Match& match : pair.matches) seen.insert(id.at(key(pair.frame_a, match.px_a)));
    }
    return seen;
  };
  std::set<int64_t> others = tracks(shares.fit);
  others.merge(tracks(shares.choice));
  const std::set<int64_t> report = tracks(shares.report);
  EXPECT_GT(report.size(), 100u);
  for (const int64_t track : report) EXPECT_EQ(others.count(track), 0u) << track;
}

// Tracks that last until they leave the picture leave too few of their own: said, not hidden.
TEST(Shares, SaysIfTracksGoOn) {
  const Recording recording = Moving(simulation::MotionKind::kSlow, 12.0);
  const Shares shares = MakeShares(recording, MakeEstimationInput(recording));
  EXPECT_TRUE(shares.report_shares_tracks);
  EXPECT_GT(Joined(shares.report).front().matches.size(), 50u);
}

}  // namespace
}  // namespace camgyro
