// Scores where the model has frames' own times (of everything else: score_test_test.cc).
#include "estimator/diagnosis/pair_scores.h"

#include <gmock/gmock.h>

#include <cmath>
#include <memory>

#include "simulation/simulate.h"

namespace camgyro {
namespace {

struct ScoreSum {
  double chi2 = 0.0, log_det = 0.0;
  int residuals = 0;
  double delay_chi2 = 0.0;  // g^2 / H of t_d, summed over the pairs
  int pairs = 0;
};

// The truth with that spread of the frames' times, 0 without.
ScoreSum ScoreAt(const simulation::Simulated& simulated, double spread_s) {
  const Recording& recording = simulated.recording;
  const EstimationInput input = MakeEstimationInput(recording, SelectPairs(recording));
  Calibration model = simulated.truth;
  if (spread_s > 0.0) {
    const auto effects = MakeEffects("frame_stamp_jitter", MakeEffectSetup(recording, model));
    EXPECT_TRUE(effects);
    model.effects = std::make_shared<EffectSet>(*effects);
    model.effect_values = Eigen::VectorXd::Constant(1, spread_s);
  }
  PairGraphOptions options;
  options.match_noise = recording.match_noise;
  options.gyro_sigma_rad_s = GyroSigma(recording, model.delay_s);
  ScoreSum sum;
  for (const PairScore& pair :
       ComputeScores(input, {input.pairs}, model, nullptr, 0.5, options).pairs) {
    sum.chi2 += pair.chi2;
    sum.log_det += pair.log_det;
    sum.residuals += pair.residuals;
    sum.delay_chi2 += pair.g[kStateDelay] * pair.g[kStateDelay] / pair.H(kStateDelay, kStateDelay);
    ++sum.pairs;
  }
  return sum;
}

TEST(PairScores, AllowForTheFramesOwnTimes) {
  const auto scenario = simulation::ParseScenario(
      "duration_s: 12\nmotion: {kind: running}\ntracks: {count: 60, noise_px: 0.5}",
      {"effects.frame_stamp_jitter.spread_s=0.002"});
  ASSERT_TRUE(scenario) << scenario.error().message;
  const auto simulated = simulation::SimulateTracks(*scenario, 4);
  ASSERT_TRUE(simulated) << simulated.error().message;
  const ScoreSum without = ScoreAt(*simulated, 0.0), with = ScoreAt(*simulated, 0.002);
  // As the noise lets expect, and not without.
  EXPECT_GT(without.chi2, 1.5 * without.residuals);
  EXPECT_NEAR(with.chi2 / with.residuals, 1.0, 0.1);
  EXPECT_EQ(without.log_det, 0.0);
  // So does what a pair says of the delay: each is chi-square of one degree of freedom.
  EXPECT_GT(without.delay_chi2, 3.0 * without.pairs);
  EXPECT_NEAR(with.delay_chi2 / with.pairs, 1.0, 5.0 * std::sqrt(2.0 / with.pairs));
  // The likelihood, times integrated out, is largest at the truth; chi2 alone falls with any
  // spread.
  const ScoreSum less = ScoreAt(*simulated, 0.001), more = ScoreAt(*simulated, 0.004);
  EXPECT_LT(with.chi2 + with.log_det, less.chi2 + less.log_det);
  EXPECT_LT(with.chi2 + with.log_det, more.chi2 + more.log_det);
  EXPECT_LT(more.chi2, with.chi2);
}

}  // namespace
}  // namespace camgyro
