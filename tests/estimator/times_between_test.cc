// Frames between the pairs of a tracker that re-anchors get times of their own, too.
#include "estimator/times_between.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/effects/catalogue.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/refinement.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

// A recording whose frames have times of their own, and a fit of every third frame.
struct Fitted {
  simulation::Simulated s;
  RefinementOptions options;
  Refined fit;
  std::set<int64_t> known;  // frames of the fit
};

constexpr double kSpreadS = 2e-3;

Fitted Fit(simulation::MotionKind motion, double noise_px, const std::string& effects) {
  simulation::Scenario scenario = ShortScenario(12.0);
  scenario.motion = simulation::MotionPreset(motion);
  scenario.tracks.reanchored = true;
  scenario.tracks.noise_px = noise_px;
  scenario.effects.frame_stamp_jitter.spread_s = kSpreadS;
  Fitted f;
  f.s = simulation::SimulateTracks(scenario).value();
  const PairSelection selection = SelectPairs(f.s.recording);
  EXPECT_TRUE(selection.leaves_frames_out());
  const EstimationInput input = MakeEstimationInput(f.s.recording, selection);
  const Prior prior = StartOffTheTruth(f.s.truth);
  Calibration start = prior.mean;
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects(effects, MakeEffectSetup(f.s.recording, start)).value());
  start.effect_values = Eigen::VectorXd::Zero(start.effects->size());
  f.options.graph.match_noise = MatchNoise::kSecondImage;
  f.fit = Refine(input, input.pairs, start, prior, f.options).value();
  for (const FrameOffset& frame : f.fit.frame_times) f.known.insert(frame.frame);
  EXPECT_LT(f.known.size(), f.s.frames.size() / 2 + 1);
  return f;
}

std::vector<FrameOffset> TimesOf(const Fitted& f) {
  return TimesOfAllFrames(f.s.recording, f.fit.calibration, f.fit.frame_times,
                          f.fit.quality.noise_px, f.options.graph);
}

// 12 s are three stretches.
TEST(TimesOfAllFrames, AreThoseOfFramesThatNoPairHas) {
  using simulation::MotionKind;
  double all_sq = 0.0;
  int all = 0;
  struct Case {
    MotionKind motion;
    double noise_px, told_share;
    std::string effects;
  };
  // What else the fit has found is held as well, right or wrong, and the offsets are those beside
  // it: a rate of the clock that were free would move all times of a stretch.
  constexpr double kWrongPpm = 300.0;
  for (const Case& c : {Case{MotionKind::kHandheld, 0.1, 0.5, "frame_stamp_jitter"},
                        Case{MotionKind::kHandheld, 0.3, 0.0, "frame_stamp_jitter"},
                        Case{MotionKind::kWalking, 0.1, 0.0, "frame_stamp_jitter"},
                        Case{MotionKind::kHandheld, 0.1, 0.5, "clock_skew,frame_stamp_jitter"}}) {
    SCOPED_TRACE(c.effects);
    Fitted f = Fit(c.motion, c.noise_px, c.effects);
    if (f.fit.calibration.effects->Has("clock_skew")) {
      f.fit.calibration.effect_values[0] += kWrongPpm;
    }
    const int64_t origin_ns = f.s.recording.gyro.front().stamp_ns;
    std::map<int64_t, double> truth_s;
    for (size_t i = 0; i < f.s.frames.size(); ++i) {
      truth_s[f.s.recording.frames[i].stamp_ns - origin_ns] = f.s.frames[i].delay_s;
    }
    const std::vector<FrameOffset> times = TimesOf(f);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end(),
                               [](const auto& a, const auto& b) { return a.frame < b.frame; }));
    double errors_sq = 0.0, sum_sq = 0.0;
    int between = 0, told = 0;
    for (const FrameOffset& frame : times) {
      if (f.known.count(frame.frame) > 0) continue;
      ++between;
      told += frame.sigma_s < 0.25 * kSpreadS ? 1 : 0;
      // An error of the delay, which all frames share, is taken back by their offsets.
      FrameTime at;
      at.stamp_s = 1e-9 * static_cast<double>(frame.frame);
      const double delay_s = DelayOf(f.fit.calibration, at);
      const double error_s = delay_s + frame.offset_s - truth_s.at(frame.frame);
      errors_sq += std::pow(error_s, 2);
      sum_sq += std::pow(error_s / frame.sigma_s, 2);
    }
    std::printf("%.1f px: %d frames, rms error %.3f ms, %.2f sigma^2\n", c.noise_px, between,
                1e3 * std::sqrt(errors_sq / between), sum_sq / between);
    EXPECT_GE(f.known.size() + static_cast<size_t>(between), f.s.frames.size() - 4);
    EXPECT_GT(told, c.told_share * between);
    EXPECT_LT(std::sqrt(errors_sq / between), 0.35 * kSpreadS);
    all_sq += sum_sq;
    all += between;
  }
  EXPECT_NEAR(all_sq / all, 1.0, 0.35);
}

// Every frame is in a pair of neighbours already: nothing is done.
TEST(TimesOfAllFrames, AreThoseOfTheFitWhereItLeavesNoFrameOut) {
  Fitted f = Fit(simulation::MotionKind::kHandheld, 0.1, "frame_stamp_jitter");
  f.s.recording.match_noise = MatchNoise::kBothImages;
  EXPECT_EQ(TimesOf(f).size(), f.fit.frame_times.size());
}

}  // namespace
}  // namespace camgyro
