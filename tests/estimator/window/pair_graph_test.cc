#include "estimator/window/pair_graph.h"

#include <gmock/gmock.h>

#include <functional>
#include <vector>

#include "estimator/window/pair_blocks.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Scenario;
using simulation::Simulated;
using simulation::SimulateTracks;

double CostOf(const PairGraph& graph) {
  FactorGraph copy = graph.graph();
  return copy.Solve({/*max_iterations=*/0}).initial_cost;
}

// Bit for bit.
void ExpectSame(const PairGraph& a, const PairGraph& b) {
  ASSERT_EQ(a.graph().blocks().size(), b.graph().blocks().size());
  for (const auto& [id, block] : a.graph().blocks()) {
    ASSERT_TRUE(b.graph().Has(id));
    EXPECT_EQ(block.value, b.graph().value(id));
  }
  ASSERT_EQ(a.graph().factors().size(), b.graph().factors().size());
  auto other = b.graph().factors().begin();
  for (const auto& [key, factor] : a.graph().factors()) {
    EXPECT_EQ(key, other->first);
    EXPECT_EQ(factor.blocks, other->second.blocks);
    ++other;
  }
  EXPECT_EQ(a.num_pairs(), b.num_pairs());
  EXPECT_EQ(CostOf(a), CostOf(b));
}

// Two graphs with the same first pair, and the pairs to come. Rates end inside the last pair; one
// sample in the fifth is missing, and so are its neighbours.
struct Twins {
  explicit Twins(const PairResidual& residual) {
    const Simulated s = SimulateTracks(FarScenario(1.0)).value();
    const EstimationInput input = MakeEstimationInput(s.recording);
    pairs = input.pairs;
    const Prior prior = StartOffTheTruth(s.truth);
    PairGraphOptions options;
    options.residual = &residual;
    for (auto* graph : {&graph_, &untouched_}) {
      *graph = std::make_unique<PairGraph>(prior.mean, prior, options);
      for (const TimedRate& rate : input.rates) {
        const double after_s = rate.time_s - pairs[5].time_a_s;
        if (after_s > 0.0 && after_s < 0.05) continue;
        if (rate.time_s < pairs.back().time_a_s) (*graph)->AddRate(rate);
      }
      EXPECT_EQ((*graph)->AddPair(pairs[1]), AddPairResult::kAdded);
    }
  }
  PairGraph& graph() { return *graph_; }
  PairGraph& untouched() { return *untouched_; }
  std::vector<TimedPair> pairs;

 private:
  std::unique_ptr<PairGraph> graph_, untouched_;
};

TEST(PairGraph, ARefusedPairChangesNothing) {
  for (const PairResidual* residual : {&ByPlane(), &ByTransfer()}) {
    SCOPED_TRACE(residual->facts().name);
    Twins twins(*residual);
    TimedPair few = twins.pairs[2];
    few.matches.resize(7);
    EXPECT_EQ(twins.graph().AddPair(few), AddPairResult::kTooFewMatches);
    TimedPair early = twins.pairs[2];
    early.time_a_s -= 10.0;
    EXPECT_EQ(twins.graph().AddPair(early), AddPairResult::kGyroTooEarly);
    TimedPair before_the_groups = twins.pairs[0];
    before_the_groups.id = 100;
    EXPECT_EQ(twins.graph().AddPair(before_the_groups), AddPairResult::kGyroTooEarly);
    EXPECT_EQ(twins.graph().AddPair(twins.pairs[5]), AddPairResult::kGyroGap);
    EXPECT_EQ(twins.graph().AddPair(twins.pairs.back()), AddPairResult::kGyroTooLate);
    ExpectSame(twins.graph(), twins.untouched());

    // And it is no worse for it.
    for (PairGraph* graph : {&twins.graph(), &twins.untouched()}) {
      ASSERT_EQ(graph->AddPair(twins.pairs[2]), AddPairResult::kAdded);
      ASSERT_TRUE(graph->Solve({4, 1e-4}).usable);
      ASSERT_TRUE(graph->MarginalizeOldest().has_value());
    }
    ExpectSame(twins.graph(), twins.untouched());
  }
}

// A reason that is found late, when the pair's rates are planned: three of ten matches have no
// transfer, since the camera turns by 80 deg.
TEST(PairGraph, APairThatIsRefusedForItsTransfersChangesNothing) {
  Prior start;
  start.mean.width_px = 640;
  start.mean.height_px = 480;
  start.mean.lens = MakePinhole(500.0, {319.5, 239.5});
  start.sigma.setOnes();
  PairGraphOptions options;
  options.residual = &ByTransfer();
  PairGraph graph(start.mean, start, options);
  for (int i = 0; i < 100; ++i) graph.AddRate({0.005 * i, {42.0, 0.0, 0.0}});
  TimedPair pair;
  pair.time_a_s = 0.2;
  pair.time_b_s = 0.2 + 1.0 / 30.0;
  for (int i = 0; i < 10; ++i) pair.matches.push_back({{60.0 * i, 239.5}, {60.0 * i, 239.5}});
  TimedPair wrong = pair;
  for (size_t i = 0; i < 3; ++i) {
    wrong.matches[i].px_a.y() = 475.0;
    wrong.matches[i].px_b.y() = 5.0;
  }
  EXPECT_EQ(graph.AddPair(wrong), AddPairResult::kTooFewMatches);
  EXPECT_EQ(graph.graph().blocks().size(), 3u);   // lens, shutter, rotation
  EXPECT_EQ(graph.graph().factors().size(), 1u);  // their prior
  EXPECT_EQ(graph.num_pairs(), 0);
  EXPECT_EQ(graph.AddPair(pair), AddPairResult::kAdded);
}

// One pixel has no ray through the lens that effects make: that is what a user is told, by whatever
// needs the pair's value, and nothing changes.
TEST(PairGraph, APixelWithoutRayIsAnError) {
  Prior prior;
  Calibration& start = prior.mean;
  start.width_px = 640;
  start.height_px = 480;
  start.lens = MakePinhole(400.0, {319.5, 239.5});
  prior.sigma.setOnes();
  start.effects = std::make_shared<const EffectSet>(
      MakeEffects("radial_distortion:radtan", EffectSetup()).value());
  start.effect_values = Eigen::Vector2d(-0.5, 0.0);  // folds 218 px from the centre
  PairGraph graph(start, prior, {});
  for (int i = 0; i < 100; ++i) graph.AddRate({0.005 * i, {0.3, 0.1, 0.0}});
  TimedPair pair;
  pair.time_a_s = 0.2;
  pair.time_b_s = 0.2 + 1.0 / 30.0;
  for (int i = 0; i < 12; ++i) {
    pair.matches.push_back(
        {{220.0 + 20.0 * i, 200.0 + 7.0 * i}, {223.0 + 20.0 * i, 205.0 + 7.0 * i}});
  }
  pair.matches[3].px_b << 5.0, 5.0;
  ASSERT_EQ(graph.AddPair(pair), AddPairResult::kAdded);
  const auto expect_error = [](const Status& status) {
    ASSERT_FALSE(status.has_value());
    EXPECT_EQ(status.error().kind, ErrorKind::kCannotEstimate);
    EXPECT_THAT(status.error().message, ::testing::HasSubstr("no ray through the lens"));
  };
  Calibration estimate = graph.Estimate();
  expect_error(graph.EstimateCovariance(2.0, 1.0, &estimate));
  expect_error(graph.MarginalizeOldest());
  EXPECT_EQ(graph.num_pairs(), 1);
  EXPECT_TRUE(graph.Residuals(0, false).empty());
  PairGraph empty(start, prior, {});
  const Status none = empty.EstimateCovariance(2.0, 1.0, &estimate);
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message, ::testing::HasSubstr("no pair of frames"));
}

// What has no transfer is left out when a pair is added: one wrong match of a fast turn, by 80 deg
// here, must not stop the whole fit.
TEST(PairGraph, LeavesOutMatchesWithoutATransfer) {
  Prior start;
  start.mean.width_px = 640;
  start.mean.height_px = 480;
  start.mean.lens = MakePinhole(500.0, {319.5, 239.5});
  start.sigma.setOnes();
  PairGraphOptions options;
  options.residual = &ByTransfer();
  const auto residuals_of = [&](int wrong) {
    PairGraph graph(start.mean, start, options);
    for (int i = 0; i < 100; ++i) graph.AddRate({0.005 * i, {42.0, 0.0, 0.0}});
    std::vector<Match> matches;
    for (int i = 0; i < 10; ++i) matches.push_back({{60.0 * i, 239.5}, {60.0 * i, 239.5}});
    // The camera turns up: what was 25 deg below its axis is 105 deg below it.
    for (int i = 0; i < wrong; ++i) {
      matches[static_cast<size_t>(i)].px_a.y() = 475.0;
      matches[static_cast<size_t>(i)].px_b.y() = 5.0;
    }
    TimedPair pair;
    pair.time_a_s = 0.2;
    pair.time_b_s = 0.2 + 1.0 / 30.0;
    pair.matches = matches;
    const AddPairResult added = graph.AddPair(pair);
    if (added != AddPairResult::kAdded) return -1;
    return static_cast<int>(graph.Residuals(0, false).size());
  };
  EXPECT_EQ(residuals_of(0), 20);
  EXPECT_EQ(residuals_of(2), 16);
  EXPECT_EQ(residuals_of(3), -1);  // fewer than 8 left
}

// Another graph of the same pairs, which needs rates from further around each pair and has not the
// first ones: the frame of a pair's first rate, in which its direction is, is another one there.
TEST(PairGraph, BeginsWhereAnotherWithOtherRatesHasEnded) {
  constexpr double kDensity = 4e-3;  // so noisy that each sample has a value of its own
  simulation::Scenario scenario = ShortScenario(3.0);
  scenario.gyro.noise_density_rad_s_rtHz = kDensity;
  const Simulated s = SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording, SelectPairs(s.recording));
  const Prior prior = StartOffTheTruth(s.truth);
  PairGraphOptions options;
  options.gyro_sigma_rad_s.setConstant(kDensity * std::sqrt(scenario.gyro.rate_hz));
  constexpr size_t kLater = 10;
  const auto made = [&](size_t first, const Calibration& start,
                        std::shared_ptr<const PairLatents> latents) {
    auto graph = std::make_unique<PairGraph>(start, prior, options, std::move(latents));
    for (const TimedRate& rate : input.rates) graph->AddRate(rate);
    for (size_t i = first; i < input.pairs.size(); ++i) {
      EXPECT_EQ(graph->AddPair(input.pairs[i]), AddPairResult::kAdded);
    }
    return graph;
  };
  const auto ended = made(kLater / 2, prior.mean, nullptr);
  ASSERT_TRUE(ended->Solve({30, 1e-6}).usable);
  const auto residuals = ended->AllResiduals(/*search=*/false);

  options.rate_margin_s += 0.0173;
  const auto again =
      made(kLater, ended->Estimate(), std::make_shared<PairLatents>(ended->Latents()));
  const auto same = again->AllResiduals(/*search=*/false);
  ASSERT_EQ(same.size() + kLater - kLater / 2, residuals.size());
  for (size_t i = 0; i < same.size(); ++i) {
    EXPECT_THAT(same[i],
                testing::Pointwise(testing::DoubleNear(1e-3), residuals[i + kLater - kLater / 2]));
  }
}

TEST(PairGraph, NoisyGyrosHaveShorterRateSteps) {
  PairGraphOptions options;
  options.gyro_sigma_rad_s.setConstant(0.003);  // of a phone, at 200 Hz
  EXPECT_EQ(options.RateStep(0.005, 650.0), 5);
  EXPECT_EQ(options.RateStep(0.05, 650.0), 1);
  options.gyro_sigma_rad_s.setConstant(0.03);  // 0.1 px per sample
  EXPECT_EQ(options.RateStep(0.005, 650.0), 3);
  options.gyro_sigma_rad_s.setConstant(0.3);
  EXPECT_EQ(options.RateStep(0.005, 650.0), 1);
}

// Directions that the parallax determines take the degrees of freedom that are counted; the best of
// many that all say nothing takes more, which widens the sigmas.
TEST(PairGraph, DirectionsWithoutParallaxWidenTheSigmas) {
  const auto inflation_of = [](Scenario scenario) {
    scenario.tracks.count = 100;
    const Simulated s = SimulateTracks(scenario).value();
    const EstimationInput input = MakeEstimationInput(s.recording);
    const Prior prior{s.truth, StateVector::Ones()};
    PairGraphOptions options;
    options.sigma = 0.7;
    PairGraph graph(prior.mean, prior, options);
    for (const TimedRate& rate : input.rates) graph.AddRate(rate);
    CrossFit sum;
    for (const TimedPair& pair : input.pairs) {
      if (graph.AddPair(pair) != AddPairResult::kAdded) continue;
      graph.Residuals(pair.id, /*search=*/true);
      sum += graph.CrossFitOf(pair.id);
    }
    // Two to six of some 50 in a half.
    EXPECT_GT(sum.expected / sum.own, 1.035);
    EXPECT_LT(sum.expected / sum.own, 1.13);
    return sum.inflation();
  };
  Scenario near = ShortScenario(4.0);
  near.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  EXPECT_NEAR(inflation_of(near), 1.1, 0.06);
  EXPECT_GT(inflation_of(FarScenario(4.0)), 1.2);
}

}  // namespace
}  // namespace camgyro
