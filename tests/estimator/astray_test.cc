// Fits that go astray for what the model lacks, and come back with it.
#include "estimator/astray.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "core/effects/catalogue.h"
#include "estimator/calibrate.h"
#include "estimator/window/pair_selection.h"
#include "tests/estimator/simulated_input.h"
#include "tests/rotations_of_pictures.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Astray, AFocalLengthRunsAwayByAFactorOfTwo) {
  EXPECT_FALSE(RanAway(500.0, 500.0));
  EXPECT_FALSE(RanAway(990.0, 500.0));
  EXPECT_FALSE(RanAway(260.0, 500.0));
  EXPECT_TRUE(RanAway(1010.0, 500.0));
  EXPECT_TRUE(RanAway(240.0, 500.0));
  EXPECT_TRUE(RanAway(-500.0, 500.0));
  EXPECT_TRUE(RanAway(std::numeric_limits<double>::quiet_NaN(), 500.0));
  EXPECT_FALSE(RanAway(0.0, 0.0));  // of attitudes
}

TEST(Astray, AFocalLengthIsStillRunning) {
  EXPECT_TRUE(IsRunningAway(1000.0, 1300.0, 450.0));
  EXPECT_TRUE(IsRunningAway(250.0, 200.0, 450.0));
  EXPECT_FALSE(IsRunningAway(1000.0, 1050.0, 450.0));  // it settles there
  EXPECT_FALSE(IsRunningAway(600.0, 800.0, 450.0));
  EXPECT_TRUE(IsRunningAway(1000.0, std::nan(""), 450.0));
  EXPECT_FALSE(IsRunningAway(0.0, 0.0, 0.0));  // of attitudes
}

TEST(Astray, AFocalLengthIsFarFromThatOfTheRotations) {
  std::optional<StartFocal> start;
  EXPECT_FALSE(IsFarFromRotations(3000.0, start));
  start = StartFocal{500.0, 5.0, /*determined=*/true, 0.5, {}};
  EXPECT_FALSE(IsFarFromRotations(590.0, start));  // 18 % are what a lens may do to the rotations
  EXPECT_TRUE(IsFarFromRotations(640.0, start));
  start->sigma_px = 50.0;
  EXPECT_FALSE(IsFarFromRotations(640.0, start));  // 2.8 of their sigmas
  start->determined = false;
  EXPECT_FALSE(IsFarFromRotations(3000.0, start));
}

TEST(Astray, WhatSpeaksAgainstAnEffect) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(1.0)).value();
  Calibration fit = s.truth;
  fit.effects = std::make_shared<const EffectSet>(
      MakeEffects("radial_distortion:radtan", MakeEffectSetup(s.recording, s.truth)).value());
  const EffectSet::Item& item = fit.effects->items().back();
  fit.effect_covariance = 1e-6 * Eigen::MatrixXd::Identity(2, 2);
  fit.effect_values = Eigen::Vector2d(-0.2, 0.05);
  const double focal_px = fit.lens[kFocal];
  EXPECT_EQ(Implausible(item, fit, focal_px), "");
  EXPECT_THAT(Implausible(item, fit, 3.0 * focal_px), HasSubstr("runs away"));
  EXPECT_TRUE(IsSeen(item, fit));
  fit.effect_values[0] = -50.0;
  EXPECT_THAT(Implausible(item, fit, focal_px), HasSubstr("k1"));
  fit.effect_values = Eigen::Vector2d(-0.002, 0.0029);  // of sigmas of 0.001
  EXPECT_FALSE(IsSeen(item, fit));
}

// What a fit leaves is each point's own, whether the tracks' errors add up from frame to frame, and
// nobody says so, or not: at the truth nothing smooth is left, off it something is.
TEST(Astray, ErrorsThatAddUpAreNotSmooth) {
  simulation::Scenario scenario = ShortScenario(4.0);
  scenario.camera.rate_hz = 60.0;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kSlow);
  scenario.tracks.count = 90;
  for (const bool reanchored : {false, true}) {
    scenario.tracks.reanchored = reanchored;
    scenario.tracks.noise_px = reanchored ? 0.1 : 0.5;
    simulation::Simulated s = simulation::SimulateTracks(scenario).value();
    s.recording.match_noise = MatchNoise::kBothImages;
    const PairSelection selection = SelectPairs(s.recording);
    const EstimationInput input = OutlineOf(s.recording, selection);
    const double noise_px = reanchored ? 0.1 * std::sqrt(0.5 * selection.gap) : 0.5;
    EXPECT_NEAR(NoiseOverSmooth(s.recording, input, s.truth, noise_px, {}), 1.0, 0.15);
    Calibration wrong = s.truth;
    wrong.delay_s += 0.15;
    EXPECT_GT(NoiseOverSmooth(s.recording, input, wrong, noise_px, {}), kNoiseOfAstray);
  }
}

// Of a camera that shows pictures twice: a few of them do not make a fit wrong; many do.
TEST(Astray, AFewPicturesThatRepeatProveNothing) {
  simulation::Scenario scenario = ShortScenario(8.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.scene.depth_m = {3.0, 6.0};
  scenario.tracks.count = 90;
  scenario.tracks.noise_px = 0.05;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const auto over_smooth = [&](size_t every) {
    Recording repeating = s.recording;
    for (size_t i = every; i < repeating.tracks.size(); i += every) {
      repeating.tracks[i] = repeating.tracks[i - 1];
    }
    const EstimationInput input = OutlineOf(repeating, SelectPairs(repeating));
    return NoiseOverSmooth(repeating, input, s.truth, scenario.tracks.noise_px, {});
  };
  EXPECT_NEAR(over_smooth(40), 1.0, 0.15);
  EXPECT_GT(over_smooth(5), kNoiseOfAstray);
}

// Residuals are of the gyro's own rates, whose noise turns the whole picture.
TEST(Astray, WhatANoisyGyroTurnsIsTakenOff) {
  simulation::Scenario scenario = ShortScenario(8.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRotation);
  scenario.gyro.noise_density_rad_s_rtHz = 3e-3;
  scenario.tracks.count = 90;
  scenario.tracks.noise_px = 0.02;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const EstimationInput input = OutlineOf(s.recording, SelectPairs(s.recording));
  PairGraphOptions options;
  options.gyro_sigma_rad_s.setZero();
  EXPECT_GT(NoiseOverSmooth(s.recording, input, s.truth, 0.02, options), kNoiseOfAstray);
  options.gyro_sigma_rad_s.setConstant(3e-3 * std::sqrt(scenario.gyro.rate_hz));
  EXPECT_LT(NoiseOverSmooth(s.recording, input, s.truth, 0.02, options), 1.2);
}

TEST(Astray, AttitudesLeaveNothingOverAPicture) {
  Recording recording;
  recording.q_cam_world.resize(2);
  EXPECT_EQ(NoiseOverSmooth(recording, {}, {}, 1e-3, {}), 0.0);
}

Result<CalibrationReport> Calibrate(const Recording& recording, const CalibrateOptions& options) {
  return CalibrateRecording(recording, RotationsOfPictures(recording, 200), options);
}

// A start that took a wrong focal length for determined is no reason to doubt a fit with a lens,
// if the rotations through that lens have the fit's focal length.
TEST(Astray, RotationsAreSeenThroughTheFittedLens) {
  const simulation::Simulated s = simulation::SimulateTracks(RoomThroughALens()).value();
  CalibrationReport report;
  report.calibration = s.truth;
  report.start.focal = StartFocal{306.0, 7.0, /*determined=*/true, 0.5, {}};
  LookThroughFittedLens(s.recording, {}, RotationsOfPictures(s.recording, 200), &report);
  EXPECT_EQ(report.start.focal->value_px, 306.0);  // no lens was fitted

  report.calibration.effects = std::make_shared<const EffectSet>(
      MakeEffects("radial_distortion:radtan", MakeEffectSetup(s.recording, s.truth)).value());
  report.calibration.effect_values = Eigen::Vector2d(-0.28, 0.07);
  LookThroughFittedLens(s.recording, {}, nullptr, &report);
  EXPECT_EQ(report.start.focal->value_px, 306.0);
  LookThroughFittedLens(s.recording, {}, RotationsOfPictures(s.recording, 200), &report);
  ASSERT_TRUE(report.start.focal->determined);
  EXPECT_NEAR(report.start.focal->value_px, 458.0, 0.1 * 458.0);
  EXPECT_FALSE(IsFarFromRotations(s.truth.lens[kFocal], report.start.focal));
}

// A stabilised lens that goes to its stops, as a Pixel's does in the hand of somebody who runs,
// makes the picture turn less, and later. A fit without it does not believe itself; what the start
// finds of it is part of the model.
TEST(CalibrateAstray, FindsAStabiliserThatNobodyHasDeclared) {
  simulation::Scenario scenario;
  scenario.duration_s = 6.0;
  scenario.camera.rate_hz = 60.0;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
  scenario.motion.rotation_rms_rad_s = {0.53, 0.41, 0.23};  // as the Pixel's
  scenario.tracks.noise_px = 0.5;
  scenario.effects.optical_stabilisation = {0.95, 0.5, 0.025};
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  CalibrateOptions options;
  options.try_what_leads_astray = options.take_stabiliser = false;
  const auto plain = Calibrate(s.recording, options);
  ASSERT_TRUE(plain.has_value()) << plain.error().message;
  EXPECT_GT(std::abs(plain->calibration.lens[kFocal] - 650.0), 50.0);
  EXPECT_THAT(plain->calibration.determined, Each(false));
  EXPECT_THAT(plain->doubts, Contains(HasSubstr("was the picture stabilised?")));

  const auto found = Calibrate(s.recording, {});
  ASSERT_TRUE(found.has_value()) << found.error().message;
  ASSERT_EQ(found->calibration.effects->items().size(), 1u);
  EXPECT_EQ(found->calibration.effects->items()[0].entry->name, "optical_stabilisation");
  const auto stabiliser = StabiliserOf(found->calibration.effects->items()[0].shape);
  ASSERT_TRUE(stabiliser.has_value());
  EXPECT_NEAR(stabiliser->corner_hz, 0.5, 0.1);
  EXPECT_NEAR(stabiliser->travel_rad, 0.025, 0.002);
  EXPECT_NEAR(found->calibration.effect_values[0], 0.95 * 650.0, 30.0);
  // What the lens does is known from the gyro's noisy samples, of which the sigmas know nothing.
  const StateVector error = Difference(found->calibration, s.truth);
  EXPECT_LT(std::abs(error[kStateFocal]), 0.01 * 650.0);
  EXPECT_LT(std::abs(error[kStateDelay]), 5e-4);
  EXPECT_LT(std::abs(error[kStateReadout]), 5e-4);
}

TEST(Astray, OnlyAStabilisedLensFollowsTurns) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(2.0)).value();
  Calibration c = s.truth;
  EXPECT_FALSE(LensFollowsTurns(c));
  for (const std::string name : {"radial_distortion", "clock_skew", "optical_stabilisation"}) {
    c.effects = std::make_shared<const EffectSet>(
        MakeEffects(name, MakeEffectSetup(s.recording, s.truth)).value());
    EXPECT_EQ(LensFollowsTurns(c), name == "optical_stabilisation") << name;
  }
}

// Without the lens's distortion, the focal length runs to six times of what it is.
TEST(CalibrateAstray, TakesInALensThatNobodyHasDeclared) {
  const simulation::Simulated s = simulation::SimulateTracks(RoomThroughALens()).value();
  CalibrateOptions options;
  options.try_what_leads_astray = false;
  const auto plain = Calibrate(s.recording, options);
  ASSERT_TRUE(plain.has_value()) << plain.error().message;
  EXPECT_GT(plain->calibration.lens[kFocal], 2.0 * s.truth.lens[kFocal]);

  const auto report = Calibrate(s.recording, {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(report->notes, Contains(HasSubstr("radial_distortion is fitted as well")));
  const Calibration& c = report->calibration;
  ASSERT_NE(c.effects, nullptr);
  EXPECT_EQ(c.effects->items().front().shape, "radtan");
  EXPECT_LT(ErrorInSigmas(c, s.truth).cwiseAbs().maxCoeff(), 4.5);
  EXPECT_LT(c.sigma()[kStateFocal], 0.02 * s.truth.lens[kFocal]);
  EXPECT_NEAR(c.effect_values[0], -0.28, 4.0 * std::sqrt(c.effect_covariance(0, 0)));
  EXPECT_LT(report->quality.noise_px, 0.8 * plain->quality.noise_px);
}

// In a pan the online estimate stays where it began; it is the fit of all pairs that runs away.
TEST(CalibrateAstray, TakesInALensAfterTheFitOfAllPairs) {
  simulation::Scenario scenario = ShortScenario(15.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kPanning);
  scenario.camera.focal_px = 458.0;
  scenario.tracks.count = 60;
  scenario.tracks.noise_px = 0.5;
  scenario.effects.radial_distortion.k1 = -0.28;
  scenario.effects.radial_distortion.k2 = 0.07;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const auto report = Calibrate(s.recording, {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(report->notes, Contains(HasSubstr("radial_distortion is fitted as well")));
  EXPECT_LT(ErrorInSigmas(report->calibration, s.truth).cwiseAbs().maxCoeff(), 4.5);
  EXPECT_EQ(report->times.front().stage, "other fits");
  EXPECT_GT(report->times.front().seconds, 0.0);
}

// From a wrong focal length, and without what the matches show of the lens (pipeline/run.h), the
// online window runs away to a lens without rays for some pixels.
TEST(CalibrateAstray, BeginsAgainWhereTheOnlineEstimateLeadsNowhere) {
  simulation::Scenario scenario = RoomThroughALens();
  scenario.seed = 3;
  simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  s.recording.camera.focal_px = 290.0;
  CalibrateOptions options;
  options.effects = "radial_distortion:radtan";
  const auto report = Calibrate(s.recording, options);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(report->notes, Contains(HasSubstr("the online estimate leads nowhere")));
  EXPECT_FALSE(report->online);
  EXPECT_LT(ErrorInSigmas(report->calibration, s.truth).cwiseAbs().maxCoeff(), 4.5);
}

// Where the lens bends nothing, no start makes it bend: one that is wrong by a factor of 3 sends
// the online estimate as far from it.
TEST(CalibrateAstray, TakesInNothingThatTheDataDoNotBearOut) {
  const simulation::Simulated s = simulation::SimulateTracks(RoomScenario()).value();
  const auto right = Calibrate(s.recording, {});
  ASSERT_TRUE(right.has_value()) << right.error().message;
  CalibrateOptions options;
  options.given_start = right->start;
  options.given_start->focal =
      StartFocal{3.0 * s.truth.lens[kFocal], 10.0, /*determined=*/true, 0.5, {}};
  const auto report = Calibrate(s.recording, options);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_EQ(report->calibration.effects, nullptr);
  EXPECT_THAT(report->notes, Not(Contains(HasSubstr("fitted as well"))));
  EXPECT_THAT(report->doubts, Contains(HasSubstr("far from the")));
  EXPECT_FALSE(report->calibration.determined[kStateFocal]);
}

}  // namespace
}  // namespace camgyro
