#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
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

// Stamps of arrival whose latencies have a mean of 5 ms, and everything else at the truth. Some
// frames are late by 20 ms: while the camera turns, most of their matches look wrong, and the
// bounded loss lets go of them. A solve alone leaves such frames at their stamps, with the sigmas
// of right times; after the search none of them is left.
TEST(PairGraph, FindsTheTimesOfFramesThatAreVeryLate) {
  constexpr double kLatencyS = 5e-3, kToldS = 2.5e-3;
  Scenario scenario = ShortScenario(20.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kSlow);
  scenario.tracks.count = 100;
  scenario.tracks.noise_px = 0.5;
  scenario.tracks.outlier_fraction = 0.02;
  scenario.effects.frame_stamp_jitter.latency_s = kLatencyS;
  const Simulated s = SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Prior prior = StartOffTheTruth(s.truth);
  Calibration start = s.truth;
  start.delay_s -= kLatencyS;  // of the frames in the mean
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start)).value());
  start.effect_values = Eigen::VectorXd::Constant(1, kLatencyS);
  PairGraphOptions options;
  options.sigma = scenario.tracks.noise_px;
  std::map<int64_t, double> truth_s;
  for (size_t i = 0; i < s.frames.size(); ++i) {
    const double stamp_s = SecondsSince(input.origin_ns, s.recording.frames[i].stamp_ns);
    truth_s[PairGraph::FrameNumber(stamp_s)] = s.frames[i].delay_s;
  }

  const auto worst_s = [&](bool search) {
    PairGraph graph(start, prior, options);
    for (const TimedRate& rate : input.rates) graph.AddRate(rate);
    for (const TimedPair& pair : input.pairs) graph.AddPair(pair);
    graph.AllResiduals(/*search=*/true);
    if (search) graph.SearchFrameTimes();
    EXPECT_TRUE(graph.Solve({}).usable);
    const double delay_s = graph.Estimate().delay_s;
    double worst = 0.0;
    for (const FrameOffset& frame : OffsetsOf(graph.FrameTimes(), kLatencyS)) {
      if (frame.sigma_s > kToldS) continue;  // the camera hardly turns
      worst = std::max(worst, std::abs(delay_s + frame.offset_s - truth_s.at(frame.frame)));
    }
    return worst;
  };
  EXPECT_GT(worst_s(/*search=*/false), 6.0 * kToldS);
  EXPECT_LT(worst_s(/*search=*/true), 5.0 * kToldS);
}

// A chain of neighbouring frames, everything else at the truth, and now and then a frame that is
// later by seven spreads. The pairs on both sides of such a frame give way together until none of
// them is wrong enough to be let go of, and a search of one pair's times at a time mends nothing.
TEST(PairGraph, UndoesTheTensionOfAChain) {
  constexpr double kSpreadS = 3.5e-3, kLateS = 25e-3;
  Scenario scenario = ShortScenario(5.0);
  scenario.seed = 3;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.tracks.count = 100;
  scenario.tracks.noise_px = 0.3;
  scenario.effects.frame_stamp_jitter.spread_s = kSpreadS;
  Simulated s = SimulateTracks(scenario).value();
  for (size_t i = 20; i < s.frames.size(); i += 10) {
    s.recording.frames[i].stamp_ns += static_cast<int64_t>(1e9 * kLateS);
    s.frames[i].delay_s -= kLateS;
  }
  const EstimationInput input = MakeEstimationInput(s.recording);
  Calibration start = s.truth;
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, start)).value());
  start.effect_values = Eigen::VectorXd::Constant(1, kSpreadS);
  PairGraphOptions options;
  options.sigma = scenario.tracks.noise_px;
  options.hold_shared = true;

  const auto off_by_five_sigmas = [&](bool with_pairs_alone) {
    PairGraph graph(start, StartOffTheTruth(s.truth), options);
    for (const TimedRate& rate : input.rates) graph.AddRate(rate);
    for (const TimedPair& pair : input.pairs) graph.AddPair(pair);
    EXPECT_TRUE(graph.Solve({}).usable);
    PairGraph::TimesAlone alone;
    if (with_pairs_alone) {
      alone = [&](int64_t id, PairTimes* times) {
        return TimesOfPairAlone(input, input.pairs[static_cast<size_t>(id)], start,
                                scenario.tracks.noise_px, options, times);
      };
    }
    graph.SearchFrameTimes(alone);
    EXPECT_TRUE(graph.Solve({}).usable);
    std::map<int64_t, double> truth_s;
    for (size_t i = 0; i < s.frames.size(); ++i) {
      const double stamp_s = SecondsSince(input.origin_ns, s.recording.frames[i].stamp_ns);
      truth_s[PairGraph::FrameNumber(stamp_s)] = s.frames[i].delay_s - s.truth.delay_s;
    }
    int off = 0;
    for (const FrameOffset& frame : OffsetsOf(graph.FrameTimes(), kSpreadS)) {
      off += std::abs(frame.offset_s - truth_s.at(frame.frame)) > 5.0 * frame.sigma_s;
    }
    return off;
  };
  EXPECT_GE(off_by_five_sigmas(false), 4);
  EXPECT_EQ(off_by_five_sigmas(true), 0);
}

}  // namespace
}  // namespace camgyro
