// Frames between the pairs of a tracker that re-anchors get times of their own, too, with sigmas
// that know what moves parts of the picture.
#include "estimator/times_between.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "core/effects/catalogue.h"
#include "core/robust_statistics.h"
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

constexpr double kShakePx = 0.5;  // five times the noise

// Moves what lies left of `right_px` in each picture, all of it by the same, by steps of this size.
void Shake(double right_px, double sigma_px, Recording* recording) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0.0, sigma_px);
  for (auto& points : recording->tracks) {
    const double x = normal(generator), y = normal(generator);
    for (TrackedPoint& point : points) {
      if (point.px.x() < right_px) point.px += Eigen::Vector2d(x, y);
    }
  }
}

// What moves the whole picture both halves take for the same times, for the most part; what moves
// one of them, not.
TEST(DisagreementOfSides, IsThatOfWhatMovesOneOfThem) {
  const Fitted f = Fit(simulation::MotionKind::kHandheld, 0.1, "frame_stamp_jitter");
  const double width_px = f.fit.calibration.width_px;
  const auto disagreement = [&](double right_px) {
    Recording recording = f.s.recording;
    Shake(right_px, kShakePx, &recording);
    return DisagreementOfSides(recording, f.fit.calibration, f.fit.frame_times,
                               f.fit.quality.noise_px, f.options.graph);
  };
  EXPECT_LT(disagreement(0.0), 1.15);
  const double of_one = disagreement(0.5 * width_px);
  EXPECT_GT(of_one, 1.8);
  // A shift across the flow is no time, and goes into directions, which each half has by itself.
  EXPECT_LT(disagreement(width_px), 0.75 * of_one);
}

TEST(TakeTimesOfAllFrames, SigmasKnowOfSidesThatDisagree) {
  const Fitted f = Fit(simulation::MotionKind::kHandheld, 0.1, "frame_stamp_jitter");
  CalibrationReport plain;
  plain.calibration = f.fit.calibration;
  plain.quality = f.fit.quality;
  plain.frame_times = f.fit.frame_times;
  CalibrationReport shaken = plain;
  TakeTimesOfAllFrames(f.s.recording, f.options.graph, &plain);
  EXPECT_TRUE(plain.notes.empty());
  EXPECT_GT(plain.frame_times.size(), f.fit.frame_times.size());
  Recording recording = f.s.recording;
  Shake(0.5 * f.fit.calibration.width_px, kShakePx, &recording);
  TakeTimesOfAllFrames(recording, f.options.graph, &shaken);
  ASSERT_EQ(shaken.notes.size(), 1u);
  const auto told = [](const CalibrationReport& report) {
    std::vector<double> sigmas_s;
    for (const FrameOffset& frame : report.frame_times) sigmas_s.push_back(frame.sigma_s);
    EXPECT_LT(*std::max_element(sigmas_s.begin(), sigmas_s.end()), kMostSpreadS);
    return MedianInPlace(&sigmas_s);
  };
  EXPECT_GT(told(shaken), 1.5 * told(plain));
}

}  // namespace
}  // namespace camgyro
