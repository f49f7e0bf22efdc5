#include "estimator/online_pass.h"

#include <gmock/gmock.h>

#include <memory>

#include "core/effects/catalogue.h"
#include "frontend/readers/repair_stamps.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

struct Passes {
  simulation::Simulated s;
  EstimationInput input;
  Prior start;

  explicit Passes(const simulation::Scenario& scenario)
      : s(simulation::SimulateTracks(scenario).value()),
        input(OutlineOf(s.recording, SelectPairs(s.recording))),
        start(StartOffTheTruth(s.truth)) {}
  OnlinePass Make() const {
    return OnlinePass(s.recording, input, SelectPairs(s.recording, kGapLimitsOnline), start.mean,
                      start, SlidingWindowOptions());
  }
};

// Where the pass is left and taken up again changes nothing.
TEST(OnlinePass, StopsWhenItHasSettledAndGoesOn) {
  const Passes passes(ShortScenario(30.0));
  OnlinePass at_once = passes.Make(), in_two = passes.Make();
  ASSERT_TRUE(at_once.Finish());
  ASSERT_TRUE(in_two.RunUntilSettled(nullptr));
  ASSERT_TRUE(in_two.has_estimate());
  EXPECT_TRUE(in_two.window().latest().settled);
  EXPECT_GE(in_two.window().num_used_pairs(), OnlinePass::kSettledPairs);
  EXPECT_LT(in_two.window().num_used_pairs(), at_once.window().num_used_pairs());
  const StateVector error =
      ErrorInSigmas(in_two.window().latest().estimate, passes.s.truth).cwiseAbs();
  EXPECT_LT(error.maxCoeff(), 4.5) << error.transpose();

  ASSERT_TRUE(in_two.Finish());
  EXPECT_EQ(in_two.window().num_used_pairs(), at_once.window().num_used_pairs());
  EXPECT_EQ(Difference(in_two.window().latest().estimate, at_once.window().latest().estimate),
            StateVector::Zero());
  EXPECT_EQ(in_two.TakeTrace().size(), at_once.TakeTrace().size());
}

// A motion that determines too little has no such moment.
TEST(OnlinePass, GoesToTheEndWithoutSettling) {
  simulation::Scenario scenario = ShortScenario(6.0);
  scenario.motion.rotation_rms_rad_s.setConstant(0.005);
  const Passes passes(scenario);
  OnlinePass pass = passes.Make();
  int told = 0;
  ASSERT_TRUE(pass.RunUntilSettled([&](const std::string& stage, double done) {
    EXPECT_EQ(stage, "window");
    EXPECT_LT(done, 1.0);
    ++told;
  }));
  EXPECT_GT(told, 3);
  EXPECT_FALSE(pass.window().latest().settled);
  OnlinePass all = passes.Make();
  ASSERT_TRUE(all.Finish());
  EXPECT_EQ(pass.window().num_used_pairs(), all.window().num_used_pairs());
}

// At 30 frames/s, what rounding to 5 ms does repeats with every third frame. To pairs that all
// begin at every sixth it was no scatter, but a focal length 15 sigmas off.
TEST(OnlinePass, SeesWhatRepeatsWithEveryThirdFrame) {
  simulation::Scenario scenario = ShortScenario(15.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.tracks.count = 90;
  scenario.tracks.noise_px = 0.3;
  simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  constexpr int64_t kStepNs = 5'000'000;
  for (Frame& frame : s.recording.frames) {
    frame.stamp_ns = (frame.stamp_ns + kStepNs / 2) / kStepNs * kStepNs;
  }
  RepairStamps(StampsMode::kAuto, &s.recording);
  Prior start = StartOffTheTruth(s.truth);
  start.mean.effects = std::make_shared<EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start.mean)).value());
  start.mean.effect_values = Eigen::VectorXd::Zero(1);
  const PairSelection selection = SelectPairs(s.recording, kGapLimitsOnline);
  ASSERT_EQ(selection.gap, 5);
  const EstimationInput input = OutlineOf(s.recording, selection);
  OnlinePass pass(s.recording, input, selection, start.mean, start, SlidingWindowOptions());
  ASSERT_TRUE(pass.Finish());
  const Calibration& c = pass.window().latest().estimate;
  EXPECT_NEAR(c.effect_values[0], 1.36e-3, 0.4e-3);
  const StateVector errors = ErrorInSigmas(c, s.truth).cwiseAbs();
  EXPECT_LT(errors.maxCoeff(), 4.0) << errors.transpose();
}

// Somebody walks past things that are 50 to 150 m away. In a window of few pairs, and short ones, a
// step sideways passes for a turn.
TEST(OnlinePass, LeavesNoParallaxToPassForATurn) {
  double errors[2] = {0.0, 0.0};  // of the bias about x: of few pairs, of the pass [rad/s]
  for (const uint64_t seed : {1, 2}) {
    simulation::Scenario scenario = ShortScenario(20.0);
    scenario.seed = seed;
    scenario.motion = simulation::MotionPreset(simulation::MotionKind::kHandheld);
    scenario.scene.depth_law = simulation::DepthLaw::kUniform;
    scenario.scene.depth_m = {50.0, 150.0};
    scenario.tracks.noise_px = 0.5;
    const Passes passes(scenario);
    const PairSelection selection = SelectPairs(passes.s.recording, kGapLimitsOnline);
    ASSERT_TRUE(selection.far);
    OnlinePass pass = passes.Make();
    ASSERT_TRUE(pass.Finish());
    // What a pass was before: pairs of a third of a second, six of them.
    SlidingWindow few(passes.start.mean, passes.start, passes.input.origin_ns, {});
    std::vector<TimedPair> pairs = SideBySide(passes.s.recording, {9, 2});
    AddMatches(passes.s.recording, &pairs);
    for (const GyroSample& sample : passes.s.recording.gyro) {
      ASSERT_EQ(few.AddGyroSample(sample), AddResult::kAccepted);
    }
    for (const TimedPair& pair : pairs) {
      ASSERT_EQ(few.AddPair(passes.s.recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns,
                            passes.s.recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns,
                            pair.matches),
                AddResult::kAccepted);
    }
    const SlidingWindow* windows[2] = {&few, &pass.window()};
    for (int i = 0; i < 2; ++i) {
      const Calibration& estimate = windows[i]->latest().estimate;
      errors[i] += std::abs((estimate.bias_gyro_rad_s - passes.s.truth.bias_gyro_rad_s).x()) / 2.0;
    }
  }
  EXPECT_GT(errors[0], 1e-3);
  EXPECT_LT(errors[1], 0.4 * errors[0]);
}

}  // namespace
}  // namespace camgyro
