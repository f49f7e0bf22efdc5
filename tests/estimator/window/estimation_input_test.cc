#include "estimator/window/estimation_input.h"

#include <gmock/gmock.h>

#include <set>
#include <vector>

#include "core/so3.h"
#include "core/time.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Simulated;
using simulation::SimulateTracks;

TEST(EstimationInput, HoldsPairsAndRatesOnOneTimeAxis) {
  const Simulated s = SimulateTracks(ShortScenario(1.0)).value();
  const EstimationInput input = MakeEstimationInput(s.recording);
  EXPECT_EQ(input.origin_ns, s.recording.gyro.front().stamp_ns);
  ASSERT_EQ(input.rates.size(), s.recording.gyro.size());
  EXPECT_EQ(input.rates.front().time_s, 0.0);
  EXPECT_EQ(input.rates[7].omega_gyro_rad_s, s.recording.gyro[7].omega_gyro_rad_s);
  ASSERT_EQ(input.pairs.size(), 30u);
  const TimedPair& pair = input.pairs[11];
  EXPECT_EQ(pair.id, 11);
  EXPECT_EQ(pair.frame_a, 11);
  EXPECT_EQ(pair.frame_b, 12);
  EXPECT_EQ(pair.time_b_s, SecondsSince(input.origin_ns, s.recording.frames[12].stamp_ns));
  EXPECT_EQ(pair.matches.size(), PairsFromTracks(s.recording.tracks, 1)[11].matches.size());

  // Attitudes of neighbouring frames; matches win over both.
  Recording attitudes = s.recording;
  attitudes.tracks.clear();
  for (size_t i = 0; i < attitudes.frames.size(); ++i) {
    attitudes.q_cam_world.push_back(Exp(Eigen::Vector3d(0.0, 0.01 * static_cast<double>(i), 0.0)));
  }
  const EstimationInput rotations = MakeEstimationInput(attitudes);
  ASSERT_EQ(rotations.pairs.size(), attitudes.frames.size() - 1);
  EXPECT_EQ(rotations.pairs[8].frame_a, 8);
  EXPECT_EQ(rotations.pairs[8].frame_b, 9);
  EXPECT_TRUE(rotations.pairs[8].matches.empty());
  // World -> camera turns by +0.01: vectors of camera b into camera a turn back.
  EXPECT_LT((Log(rotations.pairs[8].rotation.q_a_b) - Eigen::Vector3d(0.0, -0.01, 0.0)).norm(),
            1e-12);
}

// An outline is the input without its matches, which are made pair by pair.
TEST(EstimationInput, OutlineKnowsTheNumbersAndMakesTheMatchesOfChosenPairs) {
  const Simulated s = SimulateTracks(ShortScenario(1.0)).value();
  Recording with_matches = s.recording;
  with_matches.matches = PairsFromTracks(s.recording.tracks, 2);
  for (const Recording& recording : {s.recording, with_matches}) {
    const PairSelection selection{3, 2};
    const EstimationInput whole = MakeEstimationInput(recording, selection);
    const EstimationInput outline = OutlineOf(recording, selection);
    ASSERT_EQ(outline.pairs.size(), whole.pairs.size());
    EXPECT_EQ(outline.rates.size(), whole.rates.size());
    std::vector<TimedPair> chosen;
    for (size_t i = 0; i < whole.pairs.size(); i += 5) {
      EXPECT_TRUE(outline.pairs[i].matches.empty());
      EXPECT_EQ(outline.pairs[i].num_matches, whole.pairs[i].matches.size());
      chosen.push_back(outline.pairs[i]);
    }
    AddMatches(recording, &chosen);
    for (size_t k = 0; k < chosen.size(); ++k) {
      const TimedPair& expected = whole.pairs[5 * k];
      EXPECT_EQ(chosen[k].frame_a, expected.frame_a);
      EXPECT_EQ(chosen[k].frame_b, expected.frame_b);
      ASSERT_EQ(chosen[k].matches.size(), expected.matches.size());
      ASSERT_GT(expected.matches.size(), 10u);
      EXPECT_EQ(chosen[k].matches[7].px_a, expected.matches[7].px_a);
      EXPECT_EQ(chosen[k].matches[7].px_b, expected.matches[7].px_b);
    }
  }
}

// Those of errors of their own share no frame, those of a chain share their ends, and neighbours
// are all there. Where stamps are not a clock's, the others lose their step, so as to meet every
// phase of what repeats.
TEST(SideBySide, PairsDoNotOverlapAndLoseTheirStep) {
  Recording recording = SimulateTracks(ShortScenario(1.0))->recording;
  ASSERT_EQ(recording.frames.size(), 31u);
  const auto begins = [&](const PairSelection& selection) {
    std::vector<int> frames;
    for (const TimedPair& pair : SideBySide(recording, selection)) {
      EXPECT_EQ(pair.frame_b, pair.frame_a + selection.gap);
      frames.push_back(pair.frame_a);
    }
    return frames;
  };
  EXPECT_THAT(begins({5, 2}), testing::ElementsAre(0, 6, 12, 18, 24));
  EXPECT_THAT(begins({3, 3}), testing::ElementsAre(0, 3, 6, 9, 12, 15, 18, 21, 24, 27));
  recording.camera_stamps.emplace().kind = StampKind::kArrival;
  EXPECT_THAT(begins({5, 2}), testing::ElementsAre(0, 6, 12, 19, 25));
  EXPECT_THAT(begins({3, 3}), testing::ElementsAre(0, 3, 6, 10, 13, 16, 20, 23, 26));
  EXPECT_EQ(begins({1, 1}).size(), 30u);
}

}  // namespace
}  // namespace camgyro
