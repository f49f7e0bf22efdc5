#include "estimator/window/rate_groups.h"

#include <gmock/gmock.h>

#include <cmath>

#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_selection.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

constexpr double kFocalPx = 650.0;

// 200 Hz, the rate about x growing by 10 rad/s^2: values of 5 samples.
std::vector<TimedRate> Speeding() {
  std::vector<TimedRate> rates;
  for (int i = 0; i < 100; ++i) {
    rates.push_back({0.005 * i, {10.0 * 0.005 * i, 0.3, 0.0}, false});
  }
  return rates;
}

EffectSet Made(const std::string& name) {
  const auto effects = MakeEffects(name, EffectSetup());
  EXPECT_TRUE(effects);
  return *effects;
}

// A scale that is 1 % larger: the samples of a value differ by 5e-4 rad/s each from the one before,
// so that the turn is off by up to (2 + 1) * 5e-4 rad/s * 5 ms within it.
TEST(NeglectedPx, IsTheTurnWithinAValue) {
  const PairGraphOptions options;
  ASSERT_EQ(options.RateStep(0.005, kFocalPx), 5);
  const double px = NeglectedPx(Speeding(), options, kFocalPx, Made("gyro_scale"),
                                Eigen::Vector3d(0.03, 0.0, 0.0), Eigen::Vector3d(0.04, 0.0, 0.0));
  EXPECT_NEAR(px, kFocalPx * 3.0 * 5e-4 * 0.005, 1e-9);
  EXPECT_NEAR(NeglectedPx(Speeding(), options, kFocalPx, Made("gyro_scale"),
                          Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.01, 0.0)),
              0.0, 1e-12);
}

TEST(NeglectedPx, IsNothingWithoutEffectsOfTheRatesOrOfSingleSamples) {
  PairGraphOptions options;
  EXPECT_EQ(NeglectedPx(Speeding(), options, kFocalPx, Made("radial_distortion:radtan"),
                        Eigen::Vector2d::Zero(), Eigen::Vector2d(0.1, 0.1)),
            0.0);
  options.rate_step_s = 0.0;
  EXPECT_EQ(NeglectedPx(Speeding(), options, kFocalPx, Made("gyro_scale"), Eigen::Vector3d::Zero(),
                        Eigen::Vector3d(0.1, 0.1, 0.1)),
            0.0);
}

// A fit that goes on from another begins with its rates, whatever the size of their groups: of a
// gyro whose noise turns the picture by 0.6 px in 0.2 s all begins anew without them.
TEST(RateGroups, BeginWhereAnotherFitHasEnded) {
  for (const char* effect : {"", "gyro_scale"}) {
    for (const double rate_hz : {200.0, 1000.0}) {  // a sample for each value, and four
      SCOPED_TRACE(effect + std::string(" ") + std::to_string(rate_hz));
      constexpr double kDensity = 4e-3;
      simulation::Scenario scenario = ShortScenario(4.0);
      scenario.gyro.rate_hz = rate_hz;
      scenario.gyro.noise_density_rad_s_rtHz = kDensity;
      const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
      const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
      Prior prior = StartOffTheTruth(s.truth);
      if (*effect != '\0') {
        prior.mean.effects = std::make_shared<const EffectSet>(
            MakeEffects(effect, MakeEffectSetup(s.recording, prior.mean)).value());
        prior.mean.effect_values = Eigen::VectorXd::Zero(3);
      }
      PairGraphOptions options;
      options.gyro_sigma_rad_s.setConstant(kDensity * std::sqrt(rate_hz));
      const auto made = [&](const Calibration& start, std::shared_ptr<const PairLatents> latents) {
        auto graph = std::make_unique<PairGraph>(start, prior, options, std::move(latents));
        for (const TimedRate& rate : input.rates) graph->AddRate(rate);
        for (const TimedPair& pair : input.pairs) graph->AddPair(pair);
        return graph;
      };
      const auto ended = made(prior.mean, nullptr);
      ASSERT_TRUE(ended->Solve({30, 1e-6}).usable);
      const auto latents = std::make_shared<PairLatents>(ended->Latents());
      ASSERT_FALSE(latents->rates.corrections.empty());
      const auto cost_of = [](const PairGraph& graph) {
        FactorGraph copy = graph.graph();
        return copy.Solve({/*max_iterations=*/0}).initial_cost;
      };
      const double cost = cost_of(*ended);
      EXPECT_NEAR(cost_of(*made(ended->Estimate(), latents)), cost, 0.02 * cost);
      const auto without = std::make_shared<PairLatents>(*latents);
      without->rates = {};
      EXPECT_GT(cost_of(*made(ended->Estimate(), without)), 1.08 * cost);
    }
  }
}

}  // namespace
}  // namespace camgyro
