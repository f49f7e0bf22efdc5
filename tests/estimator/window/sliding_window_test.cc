// The online estimator on simulated recordings: accuracy, repeatability, refusals, memory.
#include "estimator/window/sliding_window.h"

#include <gmock/gmock.h>
#include <malloc.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "estimator/window/refinement.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Scenario;
using simulation::Simulated;
using simulation::SimulateTracks;

void ExpectIdentical(const WindowUpdate& a, const WindowUpdate& b) {
  EXPECT_EQ(a.frame_stamp_ns, b.frame_stamp_ns);
  EXPECT_EQ(a.estimate.lens, b.estimate.lens);
  EXPECT_EQ(a.estimate.delay_s, b.estimate.delay_s);
  EXPECT_EQ(a.estimate.readout_s, b.estimate.readout_s);
  EXPECT_EQ(a.estimate.bias_gyro_rad_s, b.estimate.bias_gyro_rad_s);
  EXPECT_EQ(a.estimate.q_gyro_cam.coeffs(), b.estimate.q_gyro_cam.coeffs());
  EXPECT_EQ(a.estimate.covariance, b.estimate.covariance);
  EXPECT_EQ(a.noise_px, b.noise_px);
  EXPECT_EQ(a.settled, b.settled);
}

TEST(SlidingWindow, FindsTheTruthWithinItsSigmasAndAgreesWithTheRefinement) {
  const Simulated s = SimulateTracks(ShortScenario(8.0)).value();
  SlidingWindow window = MakeWindow(s);
  FeedAll(s.recording, &window);
  EXPECT_EQ(window.num_skipped_pairs(), 0);
  EXPECT_EQ(window.num_failed_solves(), 0);
  EXPECT_EQ(window.num_used_pairs(), 240);
  const WindowUpdate last = window.latest();
  EXPECT_TRUE(last.settled);
  EXPECT_NEAR(last.noise_px, 0.7, 0.07);
  const StateVector error = ErrorInSigmas(last.estimate, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.0) << error.transpose();
  // Not by large sigmas: 0.5 % of f, 1 ms, 0.5 deg.
  EXPECT_LT(last.estimate.sigma()[kStateFocal], 3.5);
  EXPECT_LT(last.estimate.sigma()[kStateReadout], 1e-3);
  EXPECT_LT(last.estimate.sigma()[kStateDelay], 1e-3);
  EXPECT_LT(last.estimate.sigma().tail<3>().maxCoeff(), 9e-3);

  const EstimationInput input = MakeEstimationInput(s.recording);
  const Prior prior = StartOffTheTruth(s.truth);
  RefinementOptions options;
  options.graph.sigma = last.noise_px;
  const Result<Refined> refined = Refine(input, input.pairs, last.estimate, prior, options);
  ASSERT_TRUE(refined.has_value()) << refined.error().message;
  // Both use the same data: they may differ by a fraction of what each is uncertain.
  const StateVector gap =
      Difference(last.estimate, refined->calibration).cwiseQuotient(last.estimate.sigma());
  EXPECT_LT(gap.cwiseAbs().maxCoeff(), 3.0) << gap.transpose();
}

// A third of the points moves by itself. Found in the window of the present, they leave it, and do
// not come back; of a scene at rest, hardly any does.
TEST(SlidingWindow, LeavesOutTracksThatMove) {
  for (const double moving : {0.0, 0.3}) {
    SCOPED_TRACE(moving);
    Scenario scenario = ShortScenario(10.0);
    scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
    scenario.scene.moving_fraction = moving;
    scenario.tracks.count = 100;
    scenario.tracks.noise_px = 0.5;
    const Simulated s = SimulateTracks(scenario).value();
    SlidingWindow window = MakeWindow(s);
    FeedAll(s.recording, &window);
    EXPECT_EQ(window.num_failed_solves(), 0);
    EXPECT_NEAR(window.latest().noise_px, 0.5, 0.05);
    const StateVector error = ErrorInSigmas(window.latest().estimate, s.truth);
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.0) << error.transpose();
    if (moving > 0.0) {
      EXPECT_GT(window.num_moving_tracks(), 40);
    } else {
      EXPECT_LE(window.num_moving_tracks(), 2);
    }
  }
}

// Exact pixels of a camera that rests have no noise at all: the window believes no less of them
// than the refinement does.
TEST(SlidingWindow, NoiseHasALeastValue) {
  Simulated s = SimulateTracks(ShortScenario(1.0)).value();
  for (GyroSample& sample : s.recording.gyro) sample.omega_gyro_rad_s.setZero();
  for (auto& points : s.recording.tracks) points = s.recording.tracks.front();
  SlidingWindowOptions options;
  options.graph.residual = &ByTransfer();  // of a camera that rests, no direction is determined
  SlidingWindow window = MakeWindow(s, options);
  FeedAll(s.recording, &window);
  EXPECT_EQ(window.num_failed_solves(), 0) << window.failure();
  EXPECT_DOUBLE_EQ(window.latest().noise_px, NoiseScale::kLeastPx);
}

// A pixel without ray stops every solve: the last estimate stands, and the reason is known.
TEST(SlidingWindow, SaysWhyAWindowHasNoResult) {
  const Simulated s = SimulateTracks(ShortScenario(1.0)).value();
  Prior start = StartOffTheTruth(s.truth);
  start.mean.effects = std::make_shared<const EffectSet>(
      MakeEffects("radial_distortion:radtan", EffectSetup()).value());
  start.mean.effect_values = Eigen::Vector2d(-2.0, 0.0);  // folds inside the picture
  SlidingWindow window(start.mean, start, s.recording.gyro.front().stamp_ns, {});
  FeedAll(s.recording, &window);
  EXPECT_GT(window.num_failed_solves(), 0);
  EXPECT_THAT(window.failure(), ::testing::HasSubstr("the solver failed"));
  EXPECT_EQ(window.latest().estimate.lens, start.mean.lens);
}

TEST(SlidingWindow, FindsTheTruthOfAFarSceneByTransfers) {
  const Simulated s = SimulateTracks(FarScenario(8.0)).value();
  SlidingWindowOptions options;
  options.graph.residual = &ByTransfer();
  SlidingWindow window = MakeWindow(s, options);
  FeedAll(s.recording, &window);
  EXPECT_EQ(window.num_skipped_pairs(), 0);
  EXPECT_EQ(window.num_failed_solves(), 0);
  EXPECT_TRUE(window.latest().settled);
  EXPECT_NEAR(window.latest().noise_px, 0.7, 0.04);
  const StateVector error = ErrorInSigmas(window.latest().estimate, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.5) << error.transpose();
}

// Stamps at which samples arrive, in bunches after a late start: the interval of the first samples
// is no guess that pairs could share rates by.
TEST(SlidingWindow, TakesSamplesThatArriveInBunches) {
  Simulated s = SimulateTracks(ShortScenario(2.5)).value();
  std::vector<GyroSample>& gyro = s.recording.gyro;
  const auto bunch = [](size_t i) { return i < 12 ? size_t{1} : 1 + (i / 20) % 6; };
  for (size_t i = 0; i < gyro.size();) {
    const size_t end = std::min(gyro.size(), i + bunch(i));
    const int64_t arrival = gyro[end - 1].stamp_ns;
    for (const size_t last = end; i < last; ++i) {
      gyro[i].stamp_ns = arrival - static_cast<int64_t>(last - 1 - i) * 200000;  // 0.2 ms apart
    }
  }
  SlidingWindow window = MakeWindow(s);
  FeedAll(s.recording, &window);
  EXPECT_GT(window.num_used_pairs(), 60);
}

TEST(SlidingWindow, TwoRunsAreBitIdenticalAndMemoryIsBounded) {
  const Simulated s = SimulateTracks(ShortScenario(7.0)).value();
  // Settles early, so that the test is quick.
  SlidingWindowOptions options;
  options.unsettled_pairs = 60;
  options.settled_focal = 0.02;
  options.settled_readout_s = 2e-3;
  options.settled_delay_s = 1e-3;
  options.settled_rotation_rad = 1e-2;
  std::vector<WindowUpdate> first;
  std::vector<size_t> blocks, factors;
  {
    SlidingWindow window = MakeWindow(s, options);
    window.SetListener([&](const WindowUpdate& update) {
      first.push_back(update);
      if (!update.settled) return;
      blocks.push_back(window.graph().graph().blocks().size());
      factors.push_back(window.graph().graph().factors().size());
    });
    FeedAll(s.recording, &window);
    EXPECT_EQ(window.graph().num_pairs(), SlidingWindowOptions().window_pairs);
  }
  ASSERT_GT(blocks.size(), 100u);
  // After the first settled update the window shrinks to its 6 pairs. Each holds two blocks of
  // its own and a rate group; on top three global blocks, the last rates, two or three biases.
  for (size_t i = 1; i < blocks.size(); ++i) {
    ASSERT_LE(blocks[i], 3u * 7u + 3u + 2u + 3u) << i;
    ASSERT_LE(factors[i], 3u * 7u + 2u + 1u + 4u) << i;
  }
  const auto early = *std::max_element(blocks.begin() + 1, blocks.begin() + 61);
  const auto late = *std::max_element(blocks.end() - 60, blocks.end());
  EXPECT_EQ(early, late);

  std::vector<WindowUpdate> second;
  SlidingWindow window = MakeWindow(s, options);
  window.SetListener([&](const WindowUpdate& update) { second.push_back(update); });
  FeedAll(s.recording, &window);
  ASSERT_EQ(first.size(), second.size());
  for (size_t i = 0; i < first.size(); ++i) {
    SCOPED_TRACE(i);
    ExpectIdentical(first[i], second[i]);
    if (HasFailure()) break;
  }
}

// Ten times the recording, end to end, needs no more heap than twice: the window forgets. (The
// first pass fills the longest window, before the estimate has settled.)
TEST(SlidingWindowMemory, DoesNotGrowWithTheLengthOfTheRecording) {
  const Simulated s = SimulateTracks(ShortScenario(6.0)).value();
  const int64_t period_ns =
      s.recording.gyro.back().stamp_ns - s.recording.gyro.front().stamp_ns + 5'000'000;
  SlidingWindow window = MakeWindow(s);
  const std::vector<FramePair> pairs = PairsFromTracks(s.recording.tracks, 1);
  std::vector<size_t> heap_bytes;
  for (int pass = 0; pass < 10; ++pass) {
    const int64_t shift = pass * period_ns;
    size_t next = 0;
    for (const FramePair& pair : pairs) {
      const int64_t a = s.recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns;
      const int64_t b = s.recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns;
      for (; next < s.recording.gyro.size() && s.recording.gyro[next].stamp_ns <= b; ++next) {
        GyroSample sample = s.recording.gyro[next];
        sample.stamp_ns += shift;
        ASSERT_EQ(window.AddGyroSample(sample), AddResult::kAccepted);
      }
      ASSERT_EQ(window.AddPair(a + shift, b + shift, pair.matches), AddResult::kAccepted);
    }
    heap_bytes.push_back(mallinfo2().uordblks);
  }
  EXPECT_GT(window.num_used_pairs(), 1700);
  // A window of 6 pairs may happen to hold more matches or rates at that moment. The samples alone
  // of the eight passes between would be 400 kB.
  EXPECT_LT(heap_bytes.back(), heap_bytes[1] + 40'000);
}

TEST(SlidingWindow, RefusesBadDataWhichThenChangeNothing) {
  const Simulated s = SimulateTracks(ShortScenario(2.0)).value();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SlidingWindow clean = MakeWindow(s), dirty = MakeWindow(s);
  FeedAll(s.recording, &clean);

  size_t next = 0;
  for (const FramePair& pair : PairsFromTracks(s.recording.tracks, 1)) {
    const int64_t stamp_a = s.recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns;
    const int64_t stamp_b = s.recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns;
    for (; next < s.recording.gyro.size() && s.recording.gyro[next].stamp_ns <= stamp_b; ++next) {
      const GyroSample& sample = s.recording.gyro[next];
      ASSERT_EQ(dirty.AddGyroSample(sample), AddResult::kAccepted);
      ASSERT_EQ(dirty.AddGyroSample(sample), AddResult::kNotIncreasing);
      ASSERT_EQ(dirty.AddGyroSample({sample.stamp_ns - 1, sample.omega_gyro_rad_s}),
                AddResult::kNotIncreasing);
      ASSERT_EQ(dirty.AddGyroSample({sample.stamp_ns + 1, Eigen::Vector3d(0.0, nan, 0.0)}),
                AddResult::kNotFinite);
      ASSERT_EQ(
          dirty.AddGyroSample({sample.stamp_ns + 1,
                               Eigen::Vector3d(0.0, 0.0, std::numeric_limits<double>::infinity())}),
          AddResult::kNotFinite);
    }
    std::vector<Match> bad = pair.matches;
    bad.back().px_b.x() = nan;
    ASSERT_EQ(dirty.AddPair(stamp_a, stamp_b, bad), AddResult::kNotFinite);
    ASSERT_EQ(dirty.AddPair(stamp_a, stamp_a, pair.matches), AddResult::kNotIncreasing);
    // NOLINTNEXTLINE(readability-suspicious-call-argument): in the wrong order
    ASSERT_EQ(dirty.AddPair(stamp_b, stamp_a, pair.matches), AddResult::kNotIncreasing);
    ASSERT_EQ(dirty.AddPair(stamp_a, stamp_b, pair.matches), AddResult::kAccepted);
    ASSERT_EQ(dirty.AddPair(stamp_a - 1, stamp_b, pair.matches), AddResult::kNotIncreasing);
  }
  for (; next < s.recording.gyro.size(); ++next) {
    ASSERT_EQ(dirty.AddGyroSample(s.recording.gyro[next]), AddResult::kAccepted);
  }
  EXPECT_EQ(dirty.num_used_pairs(), 60);
  EXPECT_EQ(dirty.num_skipped_pairs(), 0);
  ExpectIdentical(dirty.latest(), clean.latest());
}

TEST(SlidingWindow, SkipsPairsInAGyroGapAndWithoutMatches) {
  Simulated s = SimulateTracks(ShortScenario(3.0)).value();
  const int64_t origin = s.recording.gyro.front().stamp_ns;
  // 100 ms are lost; every pair that needs a sample of it goes: some 4 frame intervals.
  std::vector<GyroSample> kept;
  for (const GyroSample& sample : s.recording.gyro) {
    const int64_t since = sample.stamp_ns - origin;
    if (since < 1'500'000'000 || since >= 1'600'000'000) kept.push_back(sample);
  }
  s.recording.gyro = kept;
  for (size_t i = 70; i < 73; ++i) s.recording.tracks[i].resize(7);  // fewer than 8 matches
  SlidingWindow window = MakeWindow(s);
  FeedAll(s.recording, &window);
  EXPECT_EQ(window.num_used_pairs() + window.num_skipped_pairs(), 90);
  EXPECT_GE(window.num_skipped_pairs(), 4 + 4);
  EXPECT_LE(window.num_skipped_pairs(), 4 + 6);
  EXPECT_EQ(window.num_failed_solves(), 0);
  const StateVector error = ErrorInSigmas(window.latest().estimate, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.0) << error.transpose();
}

TEST(SlidingWindow, APairWaitsForTheGyro) {
  const Simulated s = SimulateTracks(ShortScenario(1.0)).value();
  SlidingWindow window = MakeWindow(s);
  const std::vector<FramePair> pairs = PairsFromTracks(s.recording.tracks, 1);
  for (const FramePair& pair : pairs) {
    ASSERT_EQ(window.AddPair(s.recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns,
                             s.recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns,
                             pair.matches),
              AddResult::kAccepted);
  }
  EXPECT_EQ(window.num_used_pairs() + window.num_skipped_pairs(), 0);
  for (const GyroSample& sample : s.recording.gyro) {
    ASSERT_EQ(window.AddGyroSample(sample), AddResult::kAccepted);
  }
  EXPECT_EQ(window.num_used_pairs(), 30);
}

// Roll about the optical axis only and no translation: nothing moves with the focal length. A
// window that is kept short marginalises some 130 times, each time at another estimate. Refine says
// 0.96 of the focal length's prior on these data; what the window adds to that is false.
TEST(SlidingWindow, WhatTheMotionDoesNotDetermineKeepsItsPrior) {
  Scenario scenario = ShortScenario(5.0);
  scenario.motion.rotation_rms_rad_s = Eigen::Vector3d(0.0, 0.0, 0.8);
  scenario.motion.speed_m_s = 0.0;
  scenario.motion.sway_rms_m_s = 0.0;
  const Simulated s = SimulateTracks(scenario).value();
  SlidingWindowOptions options;
  options.unsettled_pairs = 20;
  SlidingWindow window = MakeWindow(s, options);
  std::vector<StateVector> sigmas;
  window.SetListener(
      [&](const WindowUpdate& update) { sigmas.push_back(update.estimate.sigma()); });
  FeedAll(s.recording, &window);
  ASSERT_GT(sigmas.size(), 12u);  // an unsettled window is solved every 10 of 149 pairs
  const StateVector prior = StartOffTheTruth(s.truth).sigma;
  const StateVector last = sigmas.back();
  RecordProperty("focal_share", std::to_string(last[kStateFocal] / prior[kStateFocal]));
  RecordProperty("roll_share",
                 std::to_string(last[kStateRotation + 2] / prior[kStateRotation + 2]));
  EXPECT_GT(last[kStateFocal], 0.5 * prior[kStateFocal]);
  EXPECT_GT(last[kStateRotation + 2], 0.5 * prior[kStateRotation + 2]);
  // What it does determine, it does determine.
  EXPECT_LT(last[kStateDelay], 0.1 * prior[kStateDelay]);
}

// A latent time per frame goes with the last pair that needs it, and the spread is found on the
// way.
TEST(SlidingWindow, FramesHaveTimesOfTheirOwn) {
  simulation::Scenario scenario = ShortScenario(8.0);
  scenario.effects.frame_stamp_jitter.spread_s = 2e-3;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const Prior prior = StartOffTheTruth(s.truth);
  Calibration start = prior.mean;
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start)).value());
  start.effect_values = Eigen::VectorXd::Zero(1);
  SlidingWindow window(start, prior, s.recording.gyro.front().stamp_ns, {});
  FeedAll(s.recording, &window);
  EXPECT_EQ(window.num_failed_solves(), 0);
  ASSERT_TRUE(window.latest().settled);
  const Calibration& c = window.latest().estimate;
  EXPECT_LT(ErrorInSigmas(c, s.truth).cwiseAbs().maxCoeff(), 4.5);
  EXPECT_NEAR(c.effect_values[0], 2e-3, 0.8e-3);
  int times = 0;
  for (const auto& entry : window.graph().graph().blocks()) {
    if (entry.first.kind == BlockKind::kFrameTime) ++times;
  }
  EXPECT_EQ(times, window.graph().num_pairs() + 1);  // neighbours share a frame
}

}  // namespace
}  // namespace camgyro
