#include "estimator/window/fit_pair.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

// Of somebody who runs, at the truth, with stamps of one or both of a pair's frames that are late
// by two and a half spreads: without their own times most matches of such a pair look wrong, and a
// descent that begins at the stamps ends in another minimum for half of them.
TEST(FitPair, FindsTheTimesOfFramesThatAreVeryLate) {
  constexpr double kSpreadS = 8e-3, kLateS = 20e-3;
  simulation::Scenario scenario = ShortScenario(2.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
  scenario.tracks.count = 80;
  scenario.tracks.noise_px = 0.3;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  Calibration truth = s.truth;
  truth.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(s.recording, truth)).value());
  truth.effect_values = Eigen::VectorXd::Constant(1, kSpreadS);
  const PairGraphOptions options;
  const auto right_share = [&](const TimedPair& pair) {
    PairView view;
    PairPlane plane;
    if (!FitPair(input, pair, truth, scenario.tracks.noise_px, options, &view, &plane)) return 1.0;
    double right = 0.0;
    for (size_t i = 0; i < view.bearings.a.size(); ++i) {
      right += std::abs(ResidualOf(view, plane, i).value) <= options.inlier_sigmas();
    }
    return right / static_cast<double>(view.bearings.a.size());
  };
  for (const auto& [late_a_s, late_b_s] :
       {std::pair{kLateS, 0.0}, {0.0, kLateS}, {kLateS, kLateS}}) {
    int wrong = 0;
    for (TimedPair pair : input.pairs) {
      pair.time_a_s += late_a_s;
      pair.time_b_s += late_b_s;
      wrong += right_share(pair) < 0.9;
    }
    EXPECT_LE(wrong, 1) << late_a_s << " and " << late_b_s << " s late, of " << input.pairs.size();
  }
}

}  // namespace
}  // namespace camgyro
