// Frames between the pairs of a tracker that re-anchors get times of their own, too.
#include "estimator/times_between.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "core/effects/catalogue.h"
#include "estimator/window/pair_graph.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

TEST(TimesOfAllFrames, AreThoseOfFramesThatNoPairHas) {
  constexpr double kSpreadS = 2e-3;
  simulation::Scenario scenario = ShortScenario(12.0);
  scenario.tracks.reanchored = true;
  scenario.tracks.noise_px = 0.1;
  scenario.effects.frame_stamp_jitter.spread_s = kSpreadS;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const PairSelection selection = SelectPairs(s.recording);
  ASSERT_TRUE(selection.leaves_frames_out());
  const EstimationInput input = MakeEstimationInput(s.recording, selection);
  const Prior prior = StartOffTheTruth(s.truth);
  Calibration start = prior.mean;
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start)).value());
  start.effect_values = Eigen::VectorXd::Zero(1);
  RefinementOptions options;
  options.graph.match_noise = MatchNoise::kSecondImage;
  const Result<Refined> fit = Refine(input, input.pairs, start, prior, options);
  ASSERT_TRUE(fit.has_value()) << fit.error().message;
  std::set<int64_t> known;
  for (const FrameOffset& frame : fit->frame_times) known.insert(frame.frame);
  ASSERT_LT(known.size(), s.frames.size() / 2 + 1);

  std::map<int64_t, double> truth_s;
  for (size_t i = 0; i < s.frames.size(); ++i) {
    truth_s[s.recording.frames[i].stamp_ns - input.origin_ns] = s.frames[i].delay_s;
  }
  const Calibration& c = fit->calibration;
  double sum_sq = 0.0;
  int between = 0, told = 0;
  for (const FrameOffset& frame : TimesOfAllFrames(s.recording, *fit, options, PairLimits())) {
    if (known.count(frame.frame) > 0) continue;
    ++between;
    told += frame.sigma_s < 0.25 * kSpreadS ? 1 : 0;
    // An error of the delay, which all frames share, is taken back by their offsets.
    sum_sq += std::pow((c.delay_s + frame.offset_s - truth_s.at(frame.frame)) / frame.sigma_s, 2);
  }
  EXPECT_GE(known.size() + static_cast<size_t>(between), s.frames.size() - 4);
  EXPECT_GT(told, between / 2);
  EXPECT_NEAR(sum_sq / between, 1.0, 0.35);

  // Every frame is in a pair of neighbours already: nothing is done.
  Recording both = s.recording;
  both.match_noise = MatchNoise::kBothImages;
  EXPECT_EQ(TimesOfAllFrames(both, *fit, options, PairLimits()).size(), fit->frame_times.size());
}

}  // namespace
}  // namespace camgyro
