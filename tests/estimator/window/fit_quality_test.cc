#include "estimator/window/fit_quality.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/window/residuals/all_residuals.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Simulated;
using simulation::SimulateTracks;

TEST(FitSum, BoundsWhatIsWrong) {
  PairGraphOptions options;
  FitSum sum(options, /*per_match=*/2, /*lost_per_pair=*/0);
  EXPECT_EQ(sum.rms(), 0.0);
  EXPECT_EQ(sum.inlier_ratio(), 0.0);
  sum.Add({0.6, 0.8, 300.0, 400.0}, 1.0);
  EXPECT_EQ(sum.matches(), 2);
  EXPECT_EQ(sum.inlier_ratio(), 0.5);
  const double with_wrong = sum.rms();
  EXPECT_LT(with_wrong, 5.0);
  // Of a pair that is twice as noisy, a sigma is twice as much.
  FitSum noisy(options, 2, 0);
  noisy.Add({0.6, 0.8, 300.0, 400.0}, 2.0);
  EXPECT_DOUBLE_EQ(noisy.rms(), 2.0 * with_wrong);
}

TEST(FitSum, UsuallyHasNoPairThatFitsNothing) {
  const PairGraphOptions options;
  FitSum sum(options, /*per_match=*/1, /*lost_per_pair=*/0);
  for (int pair = 0; pair < 10; ++pair) sum.Add({0.1, -0.1, 0.1}, 1.0);
  const double usual = sum.rms();
  EXPECT_DOUBLE_EQ(sum.usual_rms(), usual);
  sum.Add({0.1, 50.0}, 100.0);
  EXPECT_GT(sum.rms(), 100.0 * usual);
  EXPECT_DOUBLE_EQ(sum.usual_rms(), usual);
  EXPECT_EQ(sum.matches(), 32);
}

TEST(FitSum, UsuallyCountsDegreesOfFreedom) {
  const PairGraphOptions options;
  FitSum sum(options, /*per_match=*/1, /*lost_per_pair=*/4);
  sum.Add({0.3, 0.3, 0.3, 0.3, 0.3, -0.3}, 1.0);
  EXPECT_DOUBLE_EQ(sum.rms(), 0.3);
  EXPECT_DOUBLE_EQ(sum.usual_rms(), 0.3 * std::sqrt(6.0 / 2.0));
  sum.Add({0.3, 0.3}, 1.0);  // which a direction fits whatever they are
  EXPECT_DOUBLE_EQ(sum.usual_rms(), 0.3 * std::sqrt(8.0 / 2.0));
}

TEST(EvaluateUnseen, IsTheNoiseAtTheTruthAndMoreElsewhere) {
  const Simulated s = SimulateTracks(ShortScenario(4.0)).value();
  const EstimationInput input = MakeEstimationInput(s.recording);
  const UnseenFit at_truth = EvaluateUnseen(input, input.pairs, s.truth, 0.7, {});
  EXPECT_EQ(at_truth.pairs, 120);
  EXPECT_GT(at_truth.matches, 120 * 15);
  EXPECT_GT(at_truth.rms_px, 0.65);
  EXPECT_LT(at_truth.rms_px, 0.75);
  Calibration wrong = s.truth;
  wrong.lens[kFocal] *= 1.1;
  EXPECT_GT(EvaluateUnseen(input, input.pairs, wrong, 0.7, {}).rms_px, 1.1 * at_truth.rms_px);
  wrong = s.truth;
  wrong.delay_s += 0.02;
  EXPECT_GT(EvaluateUnseen(input, input.pairs, wrong, 0.7, {}).rms_px, 1.2 * at_truth.rms_px);
  // Pairs outside of the gyro's time are not counted.
  EstimationInput late = input;
  late.rates.erase(late.rates.begin(), late.rates.begin() + 500);  // 2.5 s, of which 0.5 before
  EXPECT_NEAR(EvaluateUnseen(late, input.pairs, s.truth, 0.7, {}).pairs, 60, 2);
}

// The direction comes from half of the matches, which are few: its own error is expected.
TEST(EvaluateUnseen, IsTheNoiseWithFewMatches) {
  simulation::Scenario scenario = ShortScenario(4.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
  scenario.tracks.count = 25;
  scenario.camera.readout_s = 0.033;
  const Simulated s = SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording);
  PairGraphOptions options;
  const UnseenFit fit = EvaluateUnseen(input, input.pairs, s.truth, 0.7, options);
  EXPECT_EQ(fit.pairs, 120);
  EXPECT_LT(fit.matches, 120 * 12);
  EXPECT_GT(fit.rms_px, 0.63);
  EXPECT_LT(fit.rms_px, 0.8);
}

// A fit has the gyro's noise in its rates; unseen pairs are turned by it.
TEST(EvaluateUnseen, KnowsWhatANoisyGyroTurns) {
  simulation::Scenario scenario = ShortScenario(4.0);
  const auto unseen = [&](double density) {
    scenario.gyro.noise_density_rad_s_rtHz = density;
    const Simulated s = SimulateTracks(scenario).value();
    const EstimationInput input = MakeEstimationInput(s.recording);
    PairGraphOptions options;
    options.gyro_sigma_rad_s.setConstant(density * std::sqrt(200.0));
    const UnseenFit fit = EvaluateUnseen(input, input.pairs, s.truth, 0.7, options);
    EXPECT_NEAR(fit.gyro_px, s.truth.lens[kFocal] * density * std::sqrt(1.0 / 30.0), 0.01);
    return fit;
  };
  const UnseenFit good = unseen(1e-4), noisy = unseen(8e-3);
  EXPECT_GT(noisy.rms_px, 1.1 * good.rms_px);
  EXPECT_LT(std::pow(noisy.rms_px, 2) - std::pow(noisy.gyro_px, 2), std::pow(good.rms_px, 2));
}

TEST(EvaluateUnseen, OfTransfersIsTheNoiseAtTheTruthAndMoreElsewhere) {
  const Simulated s = SimulateTracks(FarScenario(4.0)).value();
  const EstimationInput input = MakeEstimationInput(s.recording);
  size_t matches = 0;
  for (const TimedPair& pair : input.pairs) matches += pair.matches.size();
  PairGraphOptions options;
  options.residual = &ByTransfer();
  const UnseenFit at_truth = EvaluateUnseen(input, input.pairs, s.truth, 0.7, options);
  EXPECT_EQ(at_truth.pairs, 120);
  EXPECT_EQ(at_truth.matches, static_cast<int>(matches));
  EXPECT_NEAR(at_truth.rms_px, 0.7, 0.03);
  Calibration wrong = s.truth;
  wrong.lens[kFocal] *= 1.1;
  EXPECT_GT(EvaluateUnseen(input, input.pairs, wrong, 0.7, options).rms_px, 1.3 * at_truth.rms_px);
}

}  // namespace
}  // namespace camgyro
