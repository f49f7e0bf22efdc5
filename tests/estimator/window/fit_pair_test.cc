#include "estimator/window/fit_pair.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

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

// A view that is moved, there and back, is the one that is made at those times: also where the lens
// was logged, whose place depends on them.
TEST(FitPair, AMovedViewIsTheOneMadeAnew) {
  simulation::Scenario scenario = ShortScenario(2.0);
  scenario.tracks.count = 40;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording);
  EffectSetup setup = MakeEffectSetup(s.recording, s.truth);
  std::vector<LensSample> log;
  for (int i = 0; i <= 200; ++i) {
    log.push_back({input.origin_ns + 10'000'000 * i,
                   Eigen::Vector2d(3.0 * std::sin(0.2 * i), 2.0 * std::cos(0.3 * i))});
  }
  setup.lens_shift = std::make_shared<const LensShift>(log, input.origin_ns);
  for (const char* const list : {"radial_distortion,frame_stamp_jitter",
                                 "optical_stabilisation:logged,frame_stamp_jitter"}) {
    SCOPED_TRACE(list);
    Calibration at = s.truth;
    at.effects = std::make_shared<const EffectSet>(MakeEffects(list, setup).value());
    at.effect_values = Eigen::VectorXd::Constant(at.effects->size(), 0.01);
    const PairGraphOptions options;
    const TimedPair& pair = input.pairs[input.pairs.size() / 2];
    const Eigen::Vector2d offsets_s(4e-3, -7e-3);
    PairView made, moved;
    ASSERT_TRUE(ViewPair(input, pair, at, 0.5, options, &made, offsets_s));
    ASSERT_TRUE(ViewPair(input, pair, at, 1.0, options, &moved));
    for (const Eigen::Vector2d& to_s : {Eigen::Vector2d(-0.01, 0.02), offsets_s}) {
      ASSERT_TRUE(MoveView(input, pair, at, 0.5, options, to_s, &moved));
    }
    EXPECT_EQ(moved.measurement.sigma, made.measurement.sigma);
    EXPECT_EQ(moved.measurement.rate_times_s, made.measurement.rate_times_s);
    ASSERT_EQ(moved.bearings.a.size(), made.bearings.a.size());
    ASSERT_GE(made.bearings.a.size(), 20u);
    for (size_t i = 0; i < made.bearings.a.size(); ++i) {
      EXPECT_TRUE(moved.bearings.a[i].J_ray_px.isApprox(made.bearings.a[i].J_ray_px, 1e-12));
      EXPECT_TRUE(moved.bearings.b[i].ray_ref.isApprox(made.bearings.b[i].ray_ref, 1e-12));
    }
  }
}

}  // namespace
}  // namespace camgyro
