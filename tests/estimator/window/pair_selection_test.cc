#include "estimator/window/pair_selection.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <set>
#include <vector>

#include "core/effects/catalogue.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/refinement.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Scenario;
using simulation::SimulateTracks;

Scenario WithDepths(double nearest_m, double farthest_m) {
  Scenario scenario = ShortScenario(10.0);
  scenario.scene.depth_law = simulation::DepthLaw::kUniform;
  scenario.scene.depth_m = {nearest_m, farthest_m};
  return scenario;
}

TEST(SelectPairs, TakesLongGapsThatShareNoNoise) {
  simulation::Scenario scenario = ShortScenario(10.0);
  const Recording recording = SimulateTracks(scenario)->recording;
  const PairSelection selection = SelectPairs(recording);
  EXPECT_EQ(selection.gap % 2, 1);
  EXPECT_EQ(selection.stride, 2);
  const EstimationInput input = MakeEstimationInput(recording, selection);
  EXPECT_GE(input.pairs.size(), 100u);
  size_t matches = 0;
  std::set<int> seen;
  for (const TimedPair& pair : input.pairs) {
    EXPECT_TRUE(seen.insert(pair.frame_a).second && seen.insert(pair.frame_b).second);
    EXPECT_GE(pair.frame_b - pair.frame_a, 3);
    matches += pair.matches.size();
  }
  EXPECT_GT(static_cast<double>(matches) / static_cast<double>(input.pairs.size()), 30.0);

  Recording reanchored = recording;
  reanchored.match_noise = MatchNoise::kSecondImage;
  const PairSelection chain = SelectPairs(reanchored);  // 301 frames are too few for 3
  EXPECT_EQ(chain.gap, 2);
  EXPECT_EQ(chain.stride, 2);
  EXPECT_TRUE(chain.leaves_frames_out());
  EXPECT_FALSE(selection.leaves_frames_out());
  EXPECT_FALSE(SelectPairs(reanchored, {/*gap=*/1}).leaves_frames_out());
  EXPECT_EQ(SelectPairs(reanchored, {/*gap=*/10, /*least_pairs=*/50}).gap, 3);  // 0.1 s

  // Too short for 100 pairs, or tracks too short: neighbours.
  EXPECT_EQ(SelectPairs(SimulateTracks(ShortScenario(3.0))->recording).gap, 1);
  scenario.tracks.mean_life_frames = 4.0;
  EXPECT_EQ(SelectPairs(SimulateTracks(scenario)->recording).gap, 1);
}

// A gap is a time: at 240 frames/s nine frames would be 0.04 s, with a fifth of the parallax.
TEST(SelectPairs, GapsOfFastCamerasTakeAsLong) {
  for (const double rate_hz : {60.0, 240.0}) {
    Scenario scenario = ShortScenario(4.0);
    scenario.camera.rate_hz = rate_hz;
    scenario.camera.readout_s = 0.004;
    Recording recording = SimulateTracks(scenario)->recording;
    const double gap_s = SelectPairs(recording).gap / rate_hz;
    EXPECT_GT(gap_s, 0.16);
    EXPECT_LE(gap_s, 0.2);
    recording.match_noise = MatchNoise::kSecondImage;
    const double of_chain_s =
        SelectPairs(recording, {/*gap=*/48, /*least_pairs=*/20}).gap / rate_hz;
    EXPECT_NEAR(of_chain_s, 0.1, 0.01);
  }
}

TEST(FirstFrames, LeadFromEvenAndOddFramesAlikeWhereStepsAreLost) {
  constexpr int kFrames = 2001;
  for (const PairSelection& selection :
       {PairSelection{5, 2}, PairSelection{3, 2}, PairSelection{21, 4}, PairSelection{1, 2},
        PairSelection{1, 6}, PairSelection{3, 3}, PairSelection{2, 2}}) {
    SCOPED_TRACE(testing::Message() << selection.gap << " " << selection.stride);
    std::vector<int> every;
    for (int a = 0; a + selection.gap < kFrames; a += selection.stride) every.push_back(a);
    EXPECT_EQ(FirstFrames(selection, kFrames, /*lose_step=*/false), every);

    const std::vector<int> first = FirstFrames(selection, kFrames, /*lose_step=*/true);
    EXPECT_GT(first.size(), 0.8 * static_cast<double>(every.size()));
    EXPECT_LT(first.size(), 1.3 * static_cast<double>(every.size()));
    const auto even = std::count_if(first.begin(), first.end(), [](int a) { return a % 2 == 0; });
    // Chains of three frames a pair alternate by themselves, but for the frames that are left out.
    EXPECT_NEAR(static_cast<double>(even) / static_cast<double>(first.size()), 0.5,
                selection.leaves_frames_out() ? 0.17 : 0.06);
    EXPECT_TRUE(std::is_sorted(first.begin(), first.end()));
    EXPECT_LT(first.back() + selection.gap, kFrames);
    std::set<int> seen;
    for (const int a : first) {
      EXPECT_TRUE(seen.insert(a).second || selection.leaves_frames_out());
      EXPECT_TRUE(seen.insert(a + selection.gap).second);
    }
  }
}

// Every other stamp is 8 ms late, as where a screen's clock holds pictures back. From even frames
// alone, all pairs are longer than they say, by a time that is no chance.
TEST(FirstFrames, LeaveTheFocalLengthAloneWhereStampsAlternate) {
  Scenario scenario = ShortScenario(12.0);
  scenario.seed = 3;
  scenario.tracks.noise_px = 0.3;
  simulation::Simulated s = SimulateTracks(scenario).value();
  for (size_t i = 1; i < s.recording.frames.size(); i += 2) {
    s.recording.frames[i].stamp_ns += 8'000'000;
  }
  s.recording.camera_stamps.emplace();
  double errors[2] = {0.0, 0.0};  // from even frames alone, as selected [sigmas of f]
  for (const bool lose_step : {false, true}) {
    s.recording.camera_stamps->kind = lose_step ? StampKind::kArrival : StampKind::kMeasured;
    const EstimationInput input = MakeEstimationInput(s.recording, {5, 2});
    const Prior prior = StartOffTheTruth(s.truth);
    Calibration start = prior.mean;
    start.effects = std::make_shared<const EffectSet>(
        MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start)).value());
    start.effect_values = Eigen::VectorXd::Zero(start.effects->size());
    const Result<Refined> refined = Refine(input, input.pairs, start, prior, {});
    ASSERT_TRUE(refined.has_value()) << refined.error().message;
    errors[lose_step ? 1 : 0] = std::abs(refined->calibration.lens[kFocal] - s.truth.lens[kFocal]) /
                                refined->calibration.sigma()[kFocal];
    std::printf("lose_step %d: %.2f sigmas\n", lose_step, errors[lose_step ? 1 : 0]);
  }
  EXPECT_GT(errors[0], 3.0);
  EXPECT_LT(errors[1], 2.0);
}

// Far things, or all equally far: the gap has parallaxes that differ, or is as long as it may be.
TEST(SelectPairs, TakesLongerGapsWhereThingsAreFar) {
  const Recording near = SimulateTracks(WithDepths(1.5, 20.0))->recording,
                  far = SimulateTracks(WithDepths(30.0, 300.0))->recording,
                  equal = SimulateTracks(WithDepths(45.0, 55.0))->recording;
  const int usual = SelectPairs(near).gap;
  EXPECT_LE(usual, 6);  // 0.2 s at 30 frames/s
  EXPECT_FALSE(SelectPairs(near).far);
  EXPECT_GE(usual * ParallaxPerFrame(near, usual), kLeastParallax);
  EXPECT_LT(usual * ParallaxPerFrame(far, usual), 0.5 * kLeastParallax);
  for (const Recording* recording : {&far, &equal}) {
    const PairSelection selection = SelectPairs(*recording);
    EXPECT_GT(selection.gap, 2 * usual);
    EXPECT_LE(selection.gap, 24);  // 0.8 s
    EXPECT_EQ(selection.gap % 2, 1);
    EXPECT_EQ(selection.stride, 2);
    EXPECT_TRUE(selection.far);
    const PairSelection limited = SelectPairs(*recording, {/*gap=*/7});
    EXPECT_LE(limited.gap, 7);
    EXPECT_TRUE(limited.far);
  }
}

// Where nothing has parallax, longer pairs find none: those of estimators that go along stay short.
TEST(SelectPairs, KnowsACameraThatOnlyTurns) {
  const Recording far = SimulateTracks(WithDepths(45.0, 55.0))->recording;
  Scenario scenario = WithDepths(1.5, 20.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRotation);
  const Recording turning = SimulateTracks(scenario)->recording;
  EXPECT_GT(24 * ParallaxPerFrame(far, 24), 1.2 * kLeastFarParallax);
  EXPECT_LT(24 * ParallaxPerFrame(turning, 24), 0.8 * kLeastFarParallax);
  EXPECT_GT(SelectPairs(far, kGapLimitsOnline).gap, 9);
  const PairSelection selection = SelectPairs(turning, kGapLimitsOnline);
  EXPECT_EQ(selection.gap, 9);  // 0.3 s at 30 frames/s
  EXPECT_TRUE(selection.far);
  EXPECT_GT(SelectPairs(turning).gap, 9);
}

// Somebody walks past things that are 30 to 300 m away: in pairs of usual length their parallax
// passes for a turn, by many sigmas.
TEST(SelectPairs, LeavesNoParallaxToPassForATurn) {
  double errors[2] = {0.0, 0.0};  // of the bias about x: usual length, as selected [rad/s]
  for (const uint64_t seed : {1, 2}) {
    Scenario scenario = WithDepths(30.0, 300.0);
    scenario.duration_s = 8.0;
    scenario.seed = seed;
    scenario.tracks.noise_px = 0.5;
    const simulation::Simulated s = SimulateTracks(scenario).value();
    for (const bool longer : {false, true}) {
      const EstimationInput input =
          MakeEstimationInput(s.recording, longer ? SelectPairs(s.recording) : PairSelection{5, 2});
      const Prior start = StartOffTheTruth(s.truth);
      const Result<Refined> refined = Refine(input, input.pairs, start.mean, start, {});
      ASSERT_TRUE(refined.has_value()) << refined.error().message;
      errors[longer ? 1 : 0] +=
          std::abs((refined->calibration.bias_gyro_rad_s - s.truth.bias_gyro_rad_s).x()) / 2.0;
    }
  }
  EXPECT_GT(errors[0], 1e-3);
  EXPECT_LT(errors[1], 0.25 * errors[0]);
}

// The root of the variance of all that is no smooth motion, whoever turns and however: nearly none
// without parallax, and in proportion to how fast the camera moves past things.
TEST(ParallaxPerFrame, IsThatOfTheScene) {
  constexpr int kGap = 5;
  Scenario scenario = WithDepths(4.0, 12.0);
  const double walking = ParallaxPerFrame(SimulateTracks(scenario)->recording, kGap);
  scenario.tracks.outlier_fraction = 0.1;
  EXPECT_NEAR(ParallaxPerFrame(SimulateTracks(scenario)->recording, kGap), walking, 0.3 * walking);
  scenario.tracks.outlier_fraction = 0.0;
  scenario.tracks.noise_px *= 2.0;
  EXPECT_NEAR(ParallaxPerFrame(SimulateTracks(scenario)->recording, kGap), 0.5 * walking,
              0.2 * walking);
  // Twice as far.
  scenario = WithDepths(8.0, 24.0);
  EXPECT_NEAR(ParallaxPerFrame(SimulateTracks(scenario)->recording, kGap), 0.5 * walking,
              0.15 * walking);
  scenario = WithDepths(1e5, 1e6);
  EXPECT_LT(ParallaxPerFrame(SimulateTracks(scenario)->recording, kGap), 0.05);
  // Too few matches to tell.
  scenario.tracks.count = 2;
  EXPECT_EQ(ParallaxPerFrame(SimulateTracks(scenario)->recording, kGap),
            std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace camgyro
