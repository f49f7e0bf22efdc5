// Rivals of a round: those that lead nowhere, and those that come first.
#include "estimator/diagnosis/contest.h"

#include <gmock/gmock.h>

#include "estimator/window/gyro_noise.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using ::testing::ElementsAre;

LoopInput InputOf(const simulation::Simulated& s) {
  LoopInput in;
  in.recording = &s.recording;
  in.prior = StartOffTheTruth(s.truth);
  in.start = in.prior.mean;
  in.fit = s.truth;
  in.noise = 0.7;
  in.graph.gyro_sigma_rad_s = GyroSigma(s.recording, s.truth.delay_s);
  return in;
}

// 12 s of a run, a gyro's clock that is so much too fast, and the fit without any effect, in a
// round after the first.
struct FittedRun {
  explicit FittedRun(double skew_ppm) : s(Run(skew_ppm)) {
    choice = fits.ScoresOf(fits.shares().choice, now->calibration, nullptr, now->quality.noise_px);
    setting.fits = &fits;
    setting.now = &*now;
    setting.choice = &choice;
    setting.first_round = false;
  }
  static simulation::Simulated Run(double skew_ppm) {
    simulation::Scenario scenario = ShortScenario(12.0);
    scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
    scenario.effects.clock_skew.ppm = skew_ppm;
    return simulation::SimulateTracks(scenario).value();
  }

  simulation::Simulated s;
  LoopInput in = InputOf(s);
  DiagnoseOptions options;
  SharedFits fits{in, options};
  Result<Refined> now = fits.Fit(in.fit, in.noise);
  EffectSetup setup = MakeEffectSetup(s.recording, now->calibration);
  Scores choice;
  ContestSetting setting;
};

// A step of the delay that is not in the data, and that begins far off: the fit with it ends where
// its noise is a multiple of that without it, and is not followed there.
TEST(Contest, GivesUpARivalThatLeadsNowhere) {
  const FittedRun run(0.0);
  const EffectEntry* entry = FindEffect("delay_step");
  const ShapedEffect step = entry->step_at(run.setup, 6.0);
  Contestant rival;
  rival.candidate = {entry, step.shape, step.effect, 0};
  rival.result.name = "delay_step";
  rival.result.gain.sum = 100.0;
  rival.result.start = Eigen::VectorXd::Constant(1, -0.3);
  rival.result.start_delay_change_s = 0.3;
  std::vector<Contestant> all = {rival};
  EXPECT_FALSE(RunContest(run.setting, &all));
  EXPECT_EQ(all.front().result.rejected, "with it, the fit leads nowhere");

  // From the start that is near, the same rival is followed to its end.
  all = {rival};
  all.front().result.start.setZero();
  all.front().result.start_delay_change_s = 0.0;
  EXPECT_FALSE(RunContest(run.setting, &all));
  EXPECT_TRUE(all.front().result.refitted);
  EXPECT_EQ(all.front().result.rejected, "no gain on unseen frames beyond its noise");
}

// A clock that runs fast. Once two rivals that say so are fitted, one that leaves the noise where
// it was is given up.
TEST(Contest, GivesUpARivalWithFarMoreNoiseThanAnother) {
  const FittedRun run(1500.0);
  std::vector<Contestant> all;
  for (const char* name : {"clock_skew", "delay_wander", "gyro_scale"}) {
    const EffectEntry* entry = FindEffect(name);
    const std::string shape = entry->shapes(run.setup).back();
    Contestant rival;
    rival.candidate = {entry, shape, entry->make(run.setup, shape), 0};
    rival.result.name = name;
    rival.result.gain.sum = 100.0 - static_cast<double>(all.size());
    all.push_back(rival);
  }
  const std::optional<ContestResult> contest = RunContest(run.setting, &all);
  ASSERT_TRUE(contest);
  EXPECT_EQ(all[contest->winner].result.name, "clock_skew");
  EXPECT_TRUE(all[1].result.refitted);
  EXPECT_FALSE(all[2].result.refitted);
  EXPECT_EQ(all[2].result.rejected, "another explains more");
}

// What sends fits away is asked before anything else where a fit has run away, and fitted from the
// start; the rest is asked again when the fit is back.
TEST(Contest, BringsBackAFitThatRanAway) {
  simulation::Scenario scenario = RoomThroughALens();
  scenario.duration_s = 20.0;
  scenario.tracks.count = 150;
  scenario.tracks.noise_px = 0.3;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  LoopInput in = InputOf(s);
  in.fit.lens[kFocal] *= 8.0;
  Diagnosis diagnosis;
  const Result<Calibration> found = FindEffects(in, {}, nullptr, &diagnosis);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_THAT(diagnosis.effects, ElementsAre("radial_distortion"));
  EXPECT_NEAR(found->lens[kFocal], 458.0, 0.02 * 458.0);
  int waiting = 0;
  for (const CandidateResult& candidate : diagnosis.rounds.front().candidates) {
    EXPECT_EQ(candidate.refitted, candidate.name == "radial_distortion") << candidate.name;
    waiting += candidate.rejected == "asked when the fit is back" ? 1 : 0;
  }
  EXPECT_GT(waiting, 0);
}

}  // namespace
}  // namespace camgyro
