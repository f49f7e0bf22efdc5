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

}  // namespace
}  // namespace camgyro
