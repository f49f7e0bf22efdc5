#include "estimator/diagnosis/gain_rule.h"

#include <gmock/gmock.h>

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

// What the report share gains has no part in the choice; it confirms what was added, or does not.
TEST(GainRule, AnEffectIsConfirmedByAGainBeyondItsNoise) {
  const auto round = [](const std::string& added, double gain, double sigma) {
    DiagnosisRound r;
    r.added = added;
    r.report_gain.sum = gain;
    r.report_gain.sigma = sigma;
    return r;
  };
  EXPECT_TRUE(Confirmed(round("gyro_scale", 33.0, 23.0)));
  EXPECT_THAT(Unconfirmed({round("clock_skew", 70.0, 35.0), round("gyro_scale", 9.0, 10.0),
                           round("delay_wander", -14.0, 5.0), round("", 0.0, 0.0)}),
              testing::ElementsAre("gyro_scale", "delay_wander"));
}

}  // namespace
}  // namespace camgyro
