#include "estimator/diagnosis/gain_rule.h"

#include <gmock/gmock.h>

#include <memory>

namespace camgyro {
namespace {

constexpr double kTests = 21.0;

CandidateResult Candidate(double statistic, double p_value, double inflation, double gain,
                          double sigma) {
  CandidateResult candidate;
  candidate.statistic = statistic;
  candidate.p_value = p_value;
  candidate.inflation = inflation;
  candidate.gain.sum = gain;
  candidate.gain.sigma = sigma;
  candidate.gain.lost = std::max(0.0, sigma - gain);
  return candidate;
}

TEST(GainRule, AGainBeyondTwiceItsScatterIsEnough) {
  EXPECT_TRUE(GainBearsOut(Candidate(20.0, 4e-4, 3.0, 30.0, 14.0), kTests));
  EXPECT_FALSE(GainBearsOut(Candidate(20.0, 4e-4, 3.0, 27.0, 14.0), kTests));
}

// A lens that is not centred, 4.8 sigmas: half of 22 is expected, +- 7.
TEST(GainRule, WhereNoiseIsAloneAGainHasToAgree) {
  CandidateResult lens = Candidate(22.0, 1e-4, 1.0, 2.6, 4.4);
  EXPECT_TRUE(GainBearsOut(lens, kTests));
  lens.gain.sigma = 14.0;  // scatters beyond a right effect's
  EXPECT_FALSE(GainBearsOut(lens, kTests));
  lens.gain = {-1.3, 7.2, 8.0};
  EXPECT_FALSE(GainBearsOut(lens, kTests));  // both shares tell this one
  lens.refitted = true;
  EXPECT_TRUE(GainBearsOut(lens, kTests));  // half of them
  lens.gain.sum = -3.0;
  EXPECT_FALSE(GainBearsOut(lens, kTests));
}

// Unmodelled structure: what the statistic lets expect is worth nothing, unless there is no doubt.
TEST(GainRule, WhereBlocksScatterAGainHasToBeSureItself) {
  EXPECT_FALSE(GainBearsOut(Candidate(26.0, 8e-5, 3.2, 24.0, 29.0), kTests));
  EXPECT_TRUE(GainBearsOut(Candidate(60.0, 1e-8, 3.2, 50.0, 45.0), kTests));
}

// A step early in the recording: the few blocks that have it gain, none loses.
TEST(GainRule, TheScatterOfAnEffectOfFewBlocksIsTheEffect) {
  CandidateResult step = Candidate(40.0, 1e-4, 2.5, 400.0, 300.0);
  step.gain.lost = 10.0;
  EXPECT_TRUE(GainBearsOut(step, kTests));
  step.gain.lost = 60.0;
  EXPECT_FALSE(GainBearsOut(step, kTests));
}

// What the report share gains has no part in the choice. It contradicts only what it could show.
TEST(GainRule, AnEffectThatGainsNothingWhereItWouldShowIsUnconfirmed) {
  const auto round = [](const std::string& added, double gain, double sigma, double expected) {
    DiagnosisRound r;
    r.added = added;
    r.report_gain.sum = gain;
    r.report_gain.sigma = sigma;
    r.expected_gain = expected;
    return r;
  };
  EXPECT_FALSE(IsUnconfirmed(round("gyro_scale", 33.0, 23.0, 40.0)));
  EXPECT_FALSE(CouldConfirm(round("gyro_scale", 1.0, 2.0, 15.0)));
  EXPECT_THAT(
      Unconfirmed({round("clock_skew", 1.0, 2.0, 15.0), round("gyro_scale", 9.0, 10.0, 17.0),
                   round("delay_wander", -14.0, 5.0, 40.0), round("", 0.0, 0.0, 0.0)}),
      testing::ElementsAre("gyro_scale", "delay_wander"));
}

// By chance significant in the shares that chose it, and 1.8 sigmas in the fit of all frames.
TEST(GainRule, WhatAllFramesDoNotBearOutIsWithdrawn) {
  Calibration all_frames;
  EffectSetup setup;
  setup.frames = {FrameTime{0.0}, FrameTime{14.0}};
  all_frames.effects = std::make_shared<const EffectSet>(
      MakeEffects("focal_drift:linear,gyro_scale", setup).value());
  const EffectSet::Item &drift = all_frames.effects->items()[0],
                        &scale = all_frames.effects->items()[1];
  ASSERT_EQ(drift.entry->name, "focal_drift");
  all_frames.effect_values = Eigen::Vector4d(-0.067, 0.002, 0.002, 0.002);
  all_frames.effect_covariance = 1e-6 * Eigen::Matrix4d::Identity();
  all_frames.effect_covariance(0, 0) = 0.038 * 0.038;
  const auto round = [](const EffectSet::Item& item, double gain) {
    DiagnosisRound r;
    r.added = item.entry->name;
    r.shape = item.shape;
    r.report_gain.sum = gain;
    r.report_gain.sigma = 12.0;
    r.expected_gain = 21.0;
    return r;
  };
  std::vector<DiagnosisRound> rounds = {round(drift, -21.0)};
  EXPECT_FALSE(WithdrawByAllFrames(all_frames, 0.08, &rounds));  // p = 0.078
  EXPECT_THAT(Unconfirmed(rounds), testing::ElementsAre("focal_drift"));
  // Three parameters of two sigmas each: p = 0.0074.
  rounds = {round(drift, -21.0), round(scale, -21.0)};
  EXPECT_TRUE(WithdrawByAllFrames(all_frames, 0.01, &rounds));
  EXPECT_THAT(rounds[0].withdrawn, testing::HasSubstr("p = 0.078"));
  EXPECT_EQ(rounds[1].withdrawn, "");
  EXPECT_THAT(Unconfirmed(rounds), testing::ElementsAre("gyro_scale"));
  EXPECT_FALSE(WithdrawByAllFrames(all_frames, 0.01, &rounds));
  // Of two, the one that is less significant; the fit without it tells of the other.
  rounds = {round(scale, -21.0), round(drift, -21.0)};
  EXPECT_TRUE(WithdrawByAllFrames(all_frames, 0.001, &rounds));
  EXPECT_EQ(rounds[0].withdrawn, "");
  EXPECT_NE(rounds[1].withdrawn, "");
  rounds = {round(drift, 5.0)};
  rounds[0].expected_gain = 9.0;  // unseen frames cannot tell
  EXPECT_TRUE(WithdrawByAllFrames(all_frames, 0.01, &rounds));
  rounds = {round(drift, 20.0)};  // they confirm it
  EXPECT_FALSE(WithdrawByAllFrames(all_frames, 0.01, &rounds));
}

// 3 px of the focal length, and an effect of 0.02, by what two blocks know of both.
TEST(GainRule, WhatAShareWouldGainFollowsFromItsInformation) {
  Calibration without, with;
  with.lens[kFocal] = without.lens[kFocal] + 3.0;
  with.effect_values = Eigen::VectorXd::Constant(1, 0.02);
  BlockScore block;
  block.H = Eigen::MatrixXd::Zero(kStateSize + 1, kStateSize + 1);
  block.H(kStateFocal, kStateFocal) = 2.0;
  block.H(kStateSize, kStateSize) = 1e4;
  block.H(kStateSize, kStateFocal) = block.H(kStateFocal, kStateSize) = -50.0;
  Scores scores;
  scores.num_model = kStateSize + 1;
  scores.blocks = {block, block};
  EXPECT_NEAR(ExpectedFall(scores, without, with), 2.0 * (18.0 + 4.0 - 6.0), 1e-9);
}

}  // namespace
}  // namespace camgyro
