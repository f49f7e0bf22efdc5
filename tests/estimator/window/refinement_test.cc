// All pairs in one problem: truth, outliers, refusals, and what frames set aside say.
#include "estimator/window/refinement.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "core/time.h"
#include "estimator/window/pair_graph.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Scenario;
using simulation::Simulated;
using simulation::SimulateTracks;
using ::testing::HasSubstr;

Result<Refined> RefineFromOffTheTruth(const Simulated& s, const EstimationInput& input) {
  const Prior start = StartOffTheTruth(s.truth);
  return Refine(input, input.pairs, start.mean, start, {});
}

// Where a fit begins in which frames have times of their own.
Calibration WithFrameTimes(const Simulated& s, Calibration start) {
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start)).value());
  start.effect_values = Eigen::VectorXd::Zero(1);
  return start;
}

// A scenario of which this share of the matches is wrong: both observations must be right.
Simulated WithWrongMatches(Scenario scenario, double share) {
  scenario.tracks.outlier_fraction = 1.0 - std::sqrt(1.0 - share);
  return SimulateTracks(scenario).value();
}

TEST(Refinement, RecoversTheTruth) {
  for (const double wrong : {0.0, 0.02}) {
    SCOPED_TRACE(wrong);
    const Simulated s = WithWrongMatches(ShortScenario(4.0), wrong);
    const EstimationInput input = MakeEstimationInput(s.recording);
    const Result<Refined> refined = RefineFromOffTheTruth(s, input);
    ASSERT_TRUE(refined.has_value()) << refined.error().message;
    EXPECT_TRUE(refined->converged);
    EXPECT_EQ(refined->skipped_pairs, 0);
    EXPECT_EQ(refined->quality.pairs, 120);
    EXPECT_NEAR(refined->quality.noise_px, 0.7, 0.05);
    EXPECT_GT(refined->quality.inlier_ratio, 0.96);
    const StateVector error = ErrorInSigmas(refined->calibration, s.truth);
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.0) << error.transpose();
    const StateVector sigma = refined->calibration.sigma();
    EXPECT_LT(sigma[kStateFocal], 5.0);
    EXPECT_LT(sigma[kStateDelay], 1e-3);
    EXPECT_LT(sigma[kStateReadout], 1e-3);
  }
}

// Pictures that are blurred for a while: each pair has its noise, which is found, and the state is
// better for it.
TEST(Refinement, WeighsPairsByTheirNoise) {
  double errors[2] = {0.0, 0.0};  // all alike, each its own
  for (const uint64_t seed : {1, 2, 3, 4}) {
    Scenario scenario = ShortScenario(8.0);
    scenario.seed = seed;
    scenario.tracks.noise_scatter = 0.6;
    const Simulated s = SimulateTracks(scenario).value();
    const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
    const Prior start = StartOffTheTruth(s.truth);
    for (const bool find : {false, true}) {
      RefinementOptions options;
      options.find_noise_factors = find;
      const Result<Refined> refined = Refine(input, input.pairs, start.mean, start, options);
      ASSERT_TRUE(refined.has_value()) << refined.error().message;
      errors[find ? 1 : 0] += ErrorInSigmas(refined->calibration, s.truth).squaredNorm();
      if (!find) {
        EXPECT_EQ(refined->quality.noise_scatter, 0.0);
        continue;
      }
      EXPECT_NEAR(refined->quality.noise_scatter, 0.5, 0.15);  // of two pictures: less than 0.6
      double error_sq = 0.0;
      for (const TimedPair& pair : input.pairs) {
        double sum = 0.0;
        int count = 0;
        for (const int frame : {pair.frame_a, pair.frame_b}) {
          const auto f = static_cast<size_t>(frame);
          for (size_t k = 0; k < s.points[f].size(); ++k, ++count) {
            sum += (s.recording.tracks[f][k].px - s.points[f][k].px).squaredNorm();
          }
        }
        const double noise_px = refined->quality.noise_px * refined->noise_factors.at(pair.id);
        error_sq += std::pow(std::log(noise_px / std::sqrt(0.5 * sum / count)), 2);
      }
      EXPECT_LT(std::sqrt(error_sq / static_cast<double>(input.pairs.size())), 0.25);
    }
  }
  EXPECT_LT(errors[1], 0.8 * errors[0]);
}

// Stamps that scatter by 2 ms: with times of their own the frames are where they were, and the
// calibration is right within its sigmas; without, neither. A recording without jitter shows none.
TEST(Refinement, FramesHaveTimesOfTheirOwn) {
  Scenario scenario = ShortScenario(8.0);
  scenario.effects.frame_stamp_jitter.spread_s = 2e-3;
  const Simulated s = SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Prior prior = StartOffTheTruth(s.truth);
  const Result<Refined> without = Refine(input, input.pairs, prior.mean, prior, {});
  ASSERT_TRUE(without.has_value()) << without.error().message;
  const Calibration start = WithFrameTimes(s, prior.mean);
  const Result<Refined> refined = Refine(input, input.pairs, start, prior, {});
  ASSERT_TRUE(refined.has_value()) << refined.error().message;
  const Calibration& c = refined->calibration;
  EXPECT_LT(ErrorInSigmas(c, s.truth).cwiseAbs().maxCoeff(), 4.0);
  EXPECT_LT(refined->quality.noise_px, 0.95 * without->quality.noise_px);
  const double sigma_s = std::sqrt(c.effect_covariance(0, 0));
  EXPECT_LT(std::abs(c.effect_values[0] - 2e-3), 4.0 * sigma_s);
  EXPECT_LT(sigma_s, 0.3e-3);
  // Each frame's delay is in the truth.
  ASSERT_GT(refined->frame_times.size(), 200u);
  double sum_sq = 0.0;
  int told = 0;
  for (const FrameOffset& frame : refined->frame_times) {
    for (size_t i = 0; i < s.frames.size(); ++i) {
      if (s.recording.frames[i].stamp_ns != input.origin_ns + frame.frame) continue;
      // The delay, which all frames share, has an error of its own.
      sum_sq += std::pow(c.delay_s + frame.offset_s - s.frames[i].delay_s, 2) /
                (std::pow(frame.sigma_s, 2) + c.covariance(kStateDelay, kStateDelay));
      if (frame.sigma_s < 1e-3) ++told;
    }
  }
  EXPECT_GT(told, 100);
  EXPECT_NEAR(sum_sq / static_cast<double>(refined->frame_times.size()), 1.0, 0.35);
  // Frames that the fit has not seen tell their times by half of their matches.
  const UnseenFit as_recorded =
      EvaluateUnseen(input, input.pairs, without->calibration, refined->quality.noise_px, {});
  const UnseenFit repaired = EvaluateUnseen(input, input.pairs, c, refined->quality.noise_px, {});
  EXPECT_LT(repaired.rms_px, 0.97 * as_recorded.rms_px);

  scenario.effects.frame_stamp_jitter.spread_s = 0.0;
  const Simulated clean = SimulateTracks(scenario).value();
  const EstimationInput clean_input =
      MakeEstimationInput(clean.recording, SelectPairs(clean.recording));
  const Result<Refined> none = Refine(clean_input, clean_input.pairs, start, prior, {});
  ASSERT_TRUE(none.has_value()) << none.error().message;
  EXPECT_LT(none->calibration.effect_values[0], 0.3e-3);
  EXPECT_LT(ErrorInSigmas(none->calibration, clean.truth).cwiseAbs().maxCoeff(), 4.0);
}

// From where another fit of the same pairs ended, with its directions and its frames' own times,
// one round finds the same again; with the calibration alone, frames' times have to be found anew.
TEST(Refinement, GoesOnFromAnotherFit) {
  Scenario scenario = ShortScenario(6.0);
  scenario.effects.frame_stamp_jitter.spread_s = 2e-3;
  const Simulated s = SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Prior prior = StartOffTheTruth(s.truth);
  const Calibration start = WithFrameTimes(s, prior.mean);
  const Result<Refined> fit = Refine(input, input.pairs, start, prior, {});
  ASSERT_TRUE(fit.has_value()) << fit.error().message;
  ASSERT_NE(fit->latents, nullptr);
  EXPECT_EQ(static_cast<int>(fit->latents->planes.size()), fit->quality.pairs);
  EXPECT_EQ(fit->latents->frame_times_s.size(), fit->frame_times.size());

  RefinementOptions options;
  options.graph.sigma = fit->quality.noise_px;
  const Result<Refined> anew = Refine(input, input.pairs, fit->calibration, prior, options);
  ASSERT_TRUE(anew.has_value()) << anew.error().message;
  options.latents = fit->latents;
  const Result<Refined> again = Refine(input, input.pairs, fit->calibration, prior, options);
  ASSERT_TRUE(again.has_value()) << again.error().message;
  EXPECT_TRUE(again->converged);
  EXPECT_EQ(again->rounds, 1);
  EXPECT_GT(anew->rounds, 1);
  const StateVector moved = Difference(again->calibration, fit->calibration);
  EXPECT_LT(moved.cwiseQuotient(fit->calibration.sigma()).cwiseAbs().maxCoeff(), 0.3);
}

// One frame in 25 is late by 10 to 25 ms, and all others are on time to the microsecond: those that
// are late are found, with their times, and the others' times are known for what they are.
TEST(Refinement, FindsFramesThatAreLateNowAndThen) {
  Simulated s = SimulateTracks(ShortScenario(8.0)).value();
  const EstimationInput clean_input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Prior prior = StartOffTheTruth(s.truth);
  const Result<Refined> clean = Refine(clean_input, clean_input.pairs, prior.mean, prior, {});
  ASSERT_TRUE(clean.has_value()) << clean.error().message;

  std::map<int64_t, double> late_s;  // by PairGraph::FrameNumber
  for (size_t i = 10; i < s.recording.frames.size(); i += 25) {
    const double by_s = 1e-3 * static_cast<double>(10 + 7 * i % 16);
    s.recording.frames[i].stamp_ns += static_cast<int64_t>(1e9 * by_s);
    late_s[PairGraph::FrameNumber(
        SecondsSince(clean_input.origin_ns, s.recording.frames[i].stamp_ns))] = by_s;
  }
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Calibration start = WithFrameTimes(s, prior.mean);
  const Result<Refined> refined = Refine(input, input.pairs, start, prior, {});
  ASSERT_TRUE(refined.has_value()) << refined.error().message;
  EXPECT_LT(ErrorInSigmas(refined->calibration, s.truth).cwiseAbs().maxCoeff(), 4.0);
  EXPECT_LT(refined->calibration.effect_values[0], 0.4e-3);
  const StateVector wider = refined->calibration.sigma().cwiseQuotient(clean->calibration.sigma());
  EXPECT_LT(wider.maxCoeff(), 1.5);
  size_t late = 0;
  for (const FrameOffset& frame : refined->frame_times) {
    const auto by = late_s.find(frame.frame);
    const bool is_late = by != late_s.end();
    late += is_late ? 1 : 0;
    EXPECT_EQ(refined->late_frames.count(frame.frame) > 0, is_late) << frame.frame;
    EXPECT_NEAR(frame.offset_s, is_late ? -by->second : 0.0, 5.0 * frame.sigma_s) << frame.frame;
  }
  EXPECT_GE(late, 6U);
}

// Frames that are later than the rates around their pairs reach: the fit is made anew with more.
TEST(Refinement, KeepsRatesForFramesThatAreFarOffTheirStamps) {
  Scenario scenario = ShortScenario(6.0);
  scenario.effects.frame_stamp_jitter.spread_s = 12e-3;
  const Simulated s = SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Prior prior = StartOffTheTruth(s.truth);
  Calibration start = s.truth;
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start)).value());
  double noise_px[2] = {};
  for (const bool known : {false, true}) {
    start.effect_values = Eigen::VectorXd::Constant(1, known ? 12e-3 : 1e-3);
    const Result<Refined> fit = Refine(input, input.pairs, start, prior, {});
    ASSERT_TRUE(fit.has_value()) << fit.error().message;
    noise_px[known ? 1 : 0] = fit->quality.noise_px;
  }
  EXPECT_LT(noise_px[0], 1.01 * noise_px[1]);  // held rates: 1.02
}

// Asked from the second round on. What there is then has its covariance and its quality.
TEST(Refinement, EndsWhereItIsLost) {
  const Simulated s = SimulateTracks(ShortScenario(4.0)).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Prior start = StartOffTheTruth(s.truth);
  for (const bool lost : {false, true}) {
    int asked = 0;
    RefinementOptions options;
    options.is_lost = [&](const Calibration&, const Calibration&, double noise) {
      EXPECT_NEAR(noise, 0.7, 0.05);
      ++asked;
      return lost;
    };
    const Result<Refined> refined = Refine(input, input.pairs, start.mean, start, options);
    ASSERT_TRUE(refined.has_value()) << refined.error().message;
    EXPECT_EQ(asked, refined->rounds - 1);
    EXPECT_EQ(refined->rounds == 2, lost);
    EXPECT_EQ(refined->converged, !lost);
    EXPECT_GT(refined->calibration.sigma()[kStateFocal], 0.0);
  }
}

// Motion blur: noise along the motion five times that across. Taken for alike in all directions,
// the correction for errors in variables is wrong; the factor makes it right.
TEST(Refinement, NoiseAlongTheMotionIsNoBiasIfItIsKnown) {
  Scenario scenario = ShortScenario(10.0);
  scenario.tracks.count = 100;
  scenario.tracks.noise_px = 0.0;
  Simulated s = SimulateTracks(scenario).value();
  EstimationInput input = MakeEstimationInput(s.recording);
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal(0.0, 0.25);
  for (TimedPair& pair : input.pairs) {
    for (Match& match : pair.matches) {
      const Eigen::Vector2d along = (match.px_b - match.px_a).normalized();
      const Eigen::Matrix2d covariance =
          Eigen::Matrix2d::Identity() + 24.0 * along * along.transpose();
      const Eigen::Matrix2d L = covariance.llt().matrixL();
      const double x = normal(generator), y = normal(generator);
      match.px_b += L * Eigen::Vector2d(x, y);
      match.noise_factor_b << L(0, 0), L(1, 0), L(1, 1);
    }
  }
  const Prior start = StartOffTheTruth(s.truth);
  RefinementOptions options;
  options.graph.match_noise = MatchNoise::kSecondImage;
  const Result<Refined> known = Refine(input, input.pairs, start.mean, start, options);
  ASSERT_TRUE(known.has_value()) << known.error().message;
  EXPECT_NEAR(known->quality.noise_px, 0.25, 0.01);
  const StateVector error = ErrorInSigmas(known->calibration, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 3.5) << error.transpose();
  for (TimedPair& pair : input.pairs) {
    for (Match& match : pair.matches) match.noise_factor_b << 1.0, 0.0, 1.0;
  }
  const Result<Refined> alike = Refine(input, input.pairs, start.mean, start, options);
  ASSERT_TRUE(alike.has_value()) << alike.error().message;
  EXPECT_GT(ErrorInSigmas(alike->calibration, s.truth).cwiseAbs().maxCoeff(), 5.0);
}

// A clock that runs fast, which the model has not: some pairs turn to and fro between two
// directions and the noise that each leaves, and do not keep the others from settling.
TEST(Refinement, SettlesAlthoughSomePairsTurnToAndFro) {
  Scenario scenario = ShortScenario(40.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
  scenario.effects.clock_skew.ppm = 400.0;
  const Simulated s = SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Result<Refined> refined = RefineFromOffTheTruth(s, input);
  ASSERT_TRUE(refined.has_value()) << refined.error().message;
  EXPECT_TRUE(refined->converged);
  EXPECT_LT(refined->rounds, RefinementOptions().max_rounds);
}

// Without parallax a pair's direction means nothing, and each round finds others that fit as well:
// the state wandered with them until the rounds were used up, and counted as not determined.
TEST(Refinement, SettlesWhereDirectionsMeanNothing) {
  for (const uint64_t seed : {2, 5}) {
    SCOPED_TRACE(seed);
    Scenario scenario = ShortScenario(6.0);
    scenario.seed = seed;
    scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRotation);
    scenario.tracks.count = 100;
    scenario.tracks.noise_px = 0.3;
    scenario.effects.radial_distortion.k1 = 0.15;
    const Simulated s = SimulateTracks(scenario).value();
    const EstimationInput input = MakeEstimationInput(s.recording);
    std::vector<TimedPair> pairs;
    for (size_t i = 0; i < input.pairs.size(); i += 3) pairs.push_back(input.pairs[i]);
    const Prior prior = StartOffTheTruth(s.truth);
    Calibration start = prior.mean;
    start.effects = std::make_shared<const EffectSet>(
        MakeEffects("radial_distortion", MakeEffectSetup(s.recording, start)).value());
    start.effect_values = Eigen::VectorXd::Zero(start.effects->size());
    const Result<Refined> refined = Refine(input, pairs, start, prior, {});
    ASSERT_TRUE(refined.has_value()) << refined.error().message;
    EXPECT_TRUE(refined->converged);
    EXPECT_LE(refined->rounds, 8);
    const StateVector error = ErrorInSigmas(refined->calibration, s.truth);
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.0) << error.transpose();
  }
}

// Steps in a room, at walking pace: they turn the path in phase with the rotation, so that a prior
// which takes a part of the turn away puts it into the readout time.
TEST(Refinement, StepsThatTurnThePathAreNoBias) {
  double with_prior = 0.0, with_narrow_prior = 0.0;  // mean error of t_r in sigmas
  for (const uint64_t seed : {1, 2, 3}) {
    Scenario scenario = ShortScenario(14.0);
    scenario.seed = seed;
    scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
    scenario.motion.speed_m_s = 0.9;
    scenario.motion.path_radius_m = 1.5;
    scenario.scene.kind = simulation::SceneKind::kRoom;
    scenario.tracks.count = 100;
    scenario.tracks.noise_px = 0.3;
    const Simulated s = SimulateTracks(scenario).value();
    const EstimationInput input = MakeEstimationInput(s.recording, {5, 2});
    const Prior start = StartOffTheTruth(s.truth);
    RefinementOptions options;
    const auto error = [&] {
      const Result<Refined> refined = Refine(input, input.pairs, start.mean, start, options);
      EXPECT_TRUE(refined.has_value()) << refined.error().message;
      return refined ? ErrorInSigmas(refined->calibration, s.truth)[kStateReadout] / 3.0 : 0.0;
    };
    with_prior += error();
    options.graph.turn_sigma_rad_s = 4.0;
    with_narrow_prior += error();
  }
  EXPECT_LT(std::abs(with_prior), 2.0);
  EXPECT_LT(with_narrow_prior, -2.5);
}

// What the frontend did not reject is bent by the loss, not removed. The calibration stays close,
// but its sigmas do not cover what wrong matches do: with 15 % of them b_g errs by 18 sigma.
TEST(Refinement, StaysCloseWithManyWrongMatches) {
  const Simulated s = WithWrongMatches(ShortScenario(4.0), 0.15);
  const EstimationInput input = MakeEstimationInput(s.recording);
  const Result<Refined> refined = RefineFromOffTheTruth(s, input);
  ASSERT_TRUE(refined.has_value()) << refined.error().message;
  EXPECT_NEAR(refined->quality.inlier_ratio, 0.88, 0.04);
  EXPECT_LT(refined->quality.noise_px, 1.1);
  const StateVector error = Difference(refined->calibration, s.truth);
  EXPECT_LT(std::abs(error[kStateFocal]), 0.03 * s.truth.lens[kFocal]);
  EXPECT_LT(std::abs(error[kStateDelay]), 3e-3);
  EXPECT_LT(error.segment<3>(kStateBias).norm(), 0.05);
  RecordProperty("error_in_sigmas",
                 ::testing::PrintToString(ErrorInSigmas(refined->calibration, s.truth)));
}

// Two of its four residuals per match count: with all of them the sigmas would be too small and
// the noise wrong. Near scenes show that it is the transfer that was fitted.
TEST(Refinement, TransferRecoversTheTruthOfAFarSceneOnly) {
  RefinementOptions options;
  options.graph.residual = &ByTransfer();
  Simulated s = SimulateTracks(FarScenario(4.0)).value();
  EstimationInput input = MakeEstimationInput(s.recording);
  Prior start = StartOffTheTruth(s.truth);
  const Result<Refined> far = Refine(input, input.pairs, start.mean, start, options);
  ASSERT_TRUE(far.has_value()) << far.error().message;
  EXPECT_TRUE(far->converged);
  EXPECT_EQ(far->quality.pairs, 120);
  size_t matches = 0;
  for (const TimedPair& pair : input.pairs) matches += pair.matches.size();
  EXPECT_EQ(far->quality.matches, static_cast<int>(matches));
  EXPECT_NEAR(far->quality.noise_px, 0.7, 0.03);
  // A length of two Gaussians is within 2.5 sigma with 1 - exp(-2.5^2 / 2).
  EXPECT_NEAR(far->quality.inlier_ratio, 0.956, 0.015);
  EXPECT_NEAR(far->quality.rms_px, 0.7, 0.03);
  const StateVector error = ErrorInSigmas(far->calibration, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.0) << error.transpose();
  EXPECT_GT(error.squaredNorm(), 2.0);  // chi-square, 11 degrees: 0.2 %
  EXPECT_LT(far->calibration.sigma()[kStateFocal], 3.0);

  // No direction takes degrees of freedom: with four lost of 20, the noise would be 12 % larger.
  for (TimedPair& pair : input.pairs) pair.matches.resize(10);
  const Result<Refined> few = Refine(input, input.pairs, start.mean, start, options);
  ASSERT_TRUE(few.has_value()) << few.error().message;
  EXPECT_NEAR(few->quality.noise_px, 0.7, 0.04);

  s = SimulateTracks(ShortScenario(4.0)).value();
  input = MakeEstimationInput(s.recording);
  start = StartOffTheTruth(s.truth);
  const Result<Refined> near = Refine(input, input.pairs, start.mean, start, options);
  ASSERT_TRUE(near.has_value()) << near.error().message;
  EXPECT_GT(near->quality.noise_px, 1.0);  // parallax of the median match
  EXPECT_GT(ErrorInSigmas(near->calibration, s.truth).cwiseAbs().maxCoeff(), 10.0);
}

// Without loss the same wrong matches pull the calibration away; they are counted all the same.
TEST(Refinement, WithoutLossWrongMatchesPull) {
  for (const PairResidual* residual : {&ByPlane(), &ByTransfer()}) {
    SCOPED_TRACE(residual->facts().name);
    const bool far = residual == &ByTransfer();
    const Simulated s = WithWrongMatches(far ? FarScenario(4.0) : ShortScenario(4.0), 0.05);
    const EstimationInput input = MakeEstimationInput(s.recording);
    const Prior start = StartOffTheTruth(s.truth);
    RefinementOptions options;
    options.graph.residual = residual;
    const Result<Refined> robust = Refine(input, input.pairs, start.mean, start, options);
    options.graph.robust_threshold = 0.0;
    const Result<Refined> plain = Refine(input, input.pairs, start.mean, start, options);
    ASSERT_TRUE(robust.has_value()) << robust.error().message;
    ASSERT_TRUE(plain.has_value()) << plain.error().message;
    const StateVector sigma = robust->calibration.sigma();
    const auto error = [&](const Result<Refined>& fit) {
      return Difference(fit->calibration, s.truth).cwiseQuotient(sigma).norm();
    };
    EXPECT_GT(error(plain), 3.0 * error(robust));
    EXPECT_GT(plain->quality.inlier_ratio, 0.5);
    EXPECT_LT(plain->quality.inlier_ratio, 0.97);
    EXPECT_GT(plain->quality.rms_px, 1.5 * robust->quality.rms_px);
  }
}

TEST(Refinement, FewerThanTenPairsAreRefused) {
  const Simulated s = SimulateTracks(ShortScenario(0.5)).value();
  EstimationInput input = MakeEstimationInput(s.recording);
  ASSERT_EQ(input.pairs.size(), 15u);
  const Prior start = StartOffTheTruth(s.truth);
  const std::vector<TimedPair> nine(input.pairs.begin(), input.pairs.begin() + 9);
  const Result<Refined> few = Refine(input, nine, start.mean, start, {});
  ASSERT_FALSE(few.has_value());
  EXPECT_EQ(few.error().kind, ErrorKind::kCannotEstimate);
  EXPECT_THAT(few.error().message, HasSubstr("only 9 pairs"));
  // Fifteen pairs, of which six have too few matches.
  for (size_t i = 0; i < 6; ++i) input.pairs[2 * i].matches.resize(7);
  const Result<Refined> poor = Refine(input, input.pairs, start.mean, start, {});
  ASSERT_FALSE(poor.has_value());
  EXPECT_EQ(poor.error().kind, ErrorKind::kCannotEstimate);
  // None at all.
  const Result<Refined> none = Refine(input, {}, start.mean, start, {});
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().kind, ErrorKind::kCannotEstimate);
}

TEST(Refinement, TakesPixelsWithoutNoise) {
  Scenario scenario = ShortScenario(3.0);
  scenario.tracks.noise_px = 0.0;
  scenario.gyro.noise_density_rad_s_rtHz = 0.0;
  const Simulated s = SimulateTracks(scenario).value();
  const Result<Refined> refined = RefineFromOffTheTruth(s, MakeEstimationInput(s.recording));
  ASSERT_TRUE(refined.has_value()) << refined.error().message;
  EXPECT_NEAR(refined->calibration.delay_s, s.truth.delay_s, 1e-4);
  EXPECT_NEAR(refined->calibration.lens[kFocal], s.truth.lens[kFocal], 0.5);
}

}  // namespace
}  // namespace camgyro
