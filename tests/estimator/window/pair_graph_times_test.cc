#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>

#include "core/time.h"
#include "estimator/window/fit_pair.h"
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
// later by four spreads. The pairs on both sides of such a frame give way together until none of
// them is wrong enough to be let go of, and a search of one pair's times at a time mends nothing.
class ChainUnderTension {
 public:
  ChainUnderTension() {
    scenario_.seed = 4;
    scenario_.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
    scenario_.tracks.count = 100;
    scenario_.tracks.noise_px = 0.3;
    scenario_.effects.frame_stamp_jitter.spread_s = kSpreadS;
    s_ = SimulateTracks(scenario_).value();
    for (size_t i = 20; i < s_.frames.size(); i += 10) {
      s_.recording.frames[i].stamp_ns += static_cast<int64_t>(1e9 * kLateS);
      s_.frames[i].delay_s -= kLateS;
    }
    input_ = MakeEstimationInput(s_.recording);
    start_ = s_.truth;
    start_.effects = std::make_shared<const EffectSet>(
        MakeEffects("frame_stamp_jitter", MakeEffectSetup(s_.recording, start_)).value());
    start_.effect_values = Eigen::VectorXd::Constant(1, kSpreadS);
    options_.sigma = scenario_.tracks.noise_px;
    options_.hold_shared = true;
  }

  bool TimesAlone(int64_t id, PairTimes* times) const {
    return TimesOfPairAlone(input_, input_.pairs[static_cast<size_t>(id)], start_,
                            scenario_.tracks.noise_px, options_, times);
  }

  // Number of frames whose times are more than five sigmas off.
  int OffByFiveSigmas(const PairGraph::TimesAlone& alone) const {
    PairGraph graph(start_, StartOffTheTruth(s_.truth), options_);
    for (const TimedRate& rate : input_.rates) graph.AddRate(rate);
    for (const TimedPair& pair : input_.pairs) graph.AddPair(pair);
    EXPECT_TRUE(graph.Solve({}).usable);
    graph.SearchFrameTimes(alone);
    EXPECT_TRUE(graph.Solve({}).usable);
    std::map<int64_t, double> truth_s;
    for (size_t i = 0; i < s_.frames.size(); ++i) {
      const double stamp_s = SecondsSince(input_.origin_ns, s_.recording.frames[i].stamp_ns);
      truth_s[PairGraph::FrameNumber(stamp_s)] = s_.frames[i].delay_s - s_.truth.delay_s;
    }
    int off = 0;
    for (const FrameOffset& frame : OffsetsOf(graph.FrameTimes(), kSpreadS)) {
      off += std::abs(frame.offset_s - truth_s.at(frame.frame)) > 5.0 * frame.sigma_s;
    }
    return off;
  }

 private:
  static constexpr double kSpreadS = 5e-3, kLateS = 20e-3;

  Scenario scenario_ = ShortScenario(5.0);
  Simulated s_;
  EstimationInput input_;
  Calibration start_;
  PairGraphOptions options_;
};

TEST(PairGraph, UndoesTheTensionOfAChain) {
  const ChainUnderTension chain;
  EXPECT_GE(chain.OffByFiveSigmas(nullptr), 4);
  const auto alone = [&](int64_t id, PairTimes* times) { return chain.TimesAlone(id, times); };
  EXPECT_EQ(chain.OffByFiveSigmas(alone), 0);
}

// What pairs tell alone is another minimum now and then, with a small sigma. It is not taken for
// the sake of the frames that are mended, and does not keep those from being mended.
TEST(PairGraph, TakesWhatPairsTellAloneFrameByFrame) {
  constexpr int64_t kWrongBefore = 90;  // the tension is after
  constexpr double kWrongS = 40e-3;
  const ChainUnderTension chain;
  const auto alone = [&](int64_t id, PairTimes* times) {
    if (!chain.TimesAlone(id, times)) return false;
    if (id < kWrongBefore) {
      times->score -= times->information * Eigen::Vector2d(kWrongS, -kWrongS);
    }
    return true;
  };
  EXPECT_EQ(chain.OffByFiveSigmas(alone), 0);
}

}  // namespace
}  // namespace camgyro
