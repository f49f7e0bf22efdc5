#include "estimator/diagnosis/frame_time_test.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/so3.h"
#include "estimator/diagnosis/candidates.h"
#include "estimator/diagnosis/thresholds.h"
#include "estimator/window/gyro_noise.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

constexpr char kShort[] = R"(
duration_s: 7
motion: {kind: walking}
tracks: {count: 50, noise_px: 0.5, outlier_fraction: 0.02}
)";
// Whatever the noise of the pixels is.
constexpr double kAssumedPx = 0.5;

simulation::Simulated SimulateShort(uint64_t seed, const std::vector<std::string>& overrides) {
  auto scenario = simulation::ParseScenario(kShort, overrides);
  EXPECT_TRUE(scenario) << scenario.error().message;
  auto simulated = simulation::SimulateTracks(*scenario, seed);
  EXPECT_TRUE(simulated) << simulated.error().message;
  return *std::move(simulated);
}

// From a model that is off the truth by what a fit leaves.
FrameTimeTest TestTimes(const simulation::Simulated& simulated) {
  const Recording& recording = simulated.recording;
  Calibration model = simulated.truth;
  model.lens[kFocal] *= 1.002;
  model.delay_s += 5e-4;
  model.q_gyro_cam = model.q_gyro_cam * Exp(Eigen::Vector3d(2e-3, -2e-3, 2e-3));
  Prior prior;
  prior.mean = model;
  prior.sigma << 100.0, 17.0, 17.0, 0.02, 0.05, Eigen::Vector3d::Constant(0.1),
      Eigen::Vector3d::Constant(0.15);
  PairGraphOptions options;
  options.match_noise = recording.match_noise;
  options.gyro_sigma_rad_s = GyroSigma(recording, model.delay_s);
  const auto halves = [&](const PairSelection& selection, SplitOfMatches split) {
    const EstimationInput input = MakeEstimationInput(recording, selection);
    return ScoreHalves(input, input.pairs, model, kAssumedPx, options, split);
  };
  return TestFrameTimes(halves({1, 2}, SplitOfMatches::kSides),
                        halves({5, 2}, SplitOfMatches::kEveryOther),
                        PriorInformation(prior, nullptr, EffectSet()));
}

// The null distribution, where the noise is from less than half to twice what is assumed, and the
// gyro's ten times what is usual.
TEST(FrameTimeTest, PValuesAreUniformWhateverTheNoise) {
  const std::vector<std::vector<std::string>> scenes = {
      {"tracks.noise_px=0.2"},
      {"tracks.noise_px=1.0", "tracks.outlier_fraction=0.15"},
      {"motion.kind=running", "scene.moving_fraction=0.1"},
      {"motion.kind=handheld", "gyro.noise_density_rad_s_rtHz=0.002"}};
  std::vector<double> p_values;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    for (const auto& scene : scenes)
      p_values.push_back(TestTimes(SimulateShort(seed, scene)).times.p_value);
  }
  std::sort(p_values.begin(), p_values.end());
  double distance = 0.0;
  const auto n = static_cast<double>(p_values.size());
  for (size_t i = 0; i < p_values.size(); ++i) {
    const auto below = static_cast<double>(i);
    distance = std::max({distance, p_values[i] - below / n, (below + 1.0) / n - p_values[i]});
  }
  // Kolmogorov and Smirnov, at 1 %.
  EXPECT_LT(distance, 1.63 / std::sqrt(n)) << testing::PrintToString(p_values);
  EXPECT_GT(p_values.front(), 0.001);
}

// Compression moves blocks of a picture as a whole, each by an amount of its own.
TEST(FrameTimeTest, BlocksThatMoveAsAWholeAreNotOfTimes) {
  constexpr double kBlockPx = 48.0;
  std::vector<double> p_values;
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    simulation::Simulated simulated =
        SimulateShort(seed, {"motion.kind=running", "tracks.count=150", "tracks.noise_px=0.2"});
    std::mt19937_64 random{seed};
    std::normal_distribution<double> shift_px{0.0, 0.5};
    for (std::vector<TrackedPoint>& points : simulated.recording.tracks) {
      std::map<std::pair<int, int>, Eigen::Vector2d> shifts;
      for (TrackedPoint& point : points) {
        const std::pair<int, int> block{static_cast<int>(point.px.x() / kBlockPx),
                                        static_cast<int>(point.px.y() / kBlockPx)};
        const double u = shift_px(random), v = shift_px(random);
        point.px += shifts.try_emplace(block, u, v).first->second;
      }
    }
    p_values.push_back(TestTimes(simulated).times.p_value);
  }
  EXPECT_THAT(p_values, testing::Each(testing::Gt(0.01)));
}

TEST(FrameTimeTest, FindsTwoMilliseconds) {
  for (const char* motion : {"walking", "running", "handheld"}) {
    SCOPED_TRACE(motion);
    const FrameTimeTest test = TestTimes(SimulateShort(
        3, {std::string("motion.kind=") + motion, "effects.frame_stamp_jitter.spread_s=0.002"}));
    EXPECT_LT(test.times.p_value, 1e-4);
    EXPECT_TRUE(test.is_of_times());
    EXPECT_GT(test.rest.p_value, 1e-3);
    EXPECT_NEAR(test.spread.value_s, 0.002, 0.0008);
    EXPECT_NEAR(test.far_spread.value_s, 0.002, 0.0008);
  }
}

// A camera that shakes in its mount turns the picture about any axis: the halves agree, in times,
// too, but not in times alone.
TEST(FrameTimeTest, APictureThatShakesIsNotOfTimes) {
  simulation::Simulated simulated = SimulateShort(5, {"duration_s=20", "motion.kind=handheld"});
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (std::vector<TrackedPoint>& points : simulated.recording.tracks) {
    const double u = 1.5 * normal(random);
    const double v = 1.5 * normal(random);
    for (TrackedPoint& point : points) point.px += Eigen::Vector2d(u, v);
  }
  const FrameTimeTest test = TestTimes(simulated);
  EXPECT_LT(test.times.p_value, 1e-4);
  EXPECT_LT(test.rest.p_value, kRestP);
  EXPECT_FALSE(test.is_of_times());
}

// A gyro that reads too much at high rates turns about the axis of the rotation, which times do,
// too, but not by as much for frames that are near.
TEST(FrameTimeTest, AGyroThatIsNotLinearIsNotOfTimes) {
  simulation::Simulated simulated = SimulateShort(8, {"motion.kind=running", "duration_s=20"});
  for (GyroSample& sample : simulated.recording.gyro) {
    const Eigen::Vector3d omega = sample.omega_gyro_rad_s;
    sample.omega_gyro_rad_s += 0.08 * omega.cwiseAbs().cwiseProduct(omega);
  }
  const FrameTimeTest test = TestTimes(simulated);
  EXPECT_LT(test.times.p_value, 1e-4);
  EXPECT_LT(test.spread.value_s, 0.3 * test.far_spread.value_s);
  EXPECT_FALSE(test.is_of_times());
}

// Neighbours are off by almost the same.
TEST(FrameTimeTest, ADelayThatWandersIsNotOfTimes) {
  const FrameTimeTest test =
      TestTimes(SimulateShort(6, {"effects.delay_wander={amplitude_s: 0.004, period_s: 7}"}));
  EXPECT_GT(test.far_spread.value_s, 0.001);
  EXPECT_LT(test.spread.value_s, 0.3 * test.far_spread.value_s);
  EXPECT_FALSE(test.is_of_times());
}

// By hand: pairs whose halves say exactly the same have x = s W^-1 s each, all alike, and n of them
// are sqrt(n) sigmas; halves that say the opposite are as many below.
TEST(FrameTimeTest, AgreementOfHalvesByHand) {
  const Eigen::Index model = kStateSize;
  const auto make = [&](double sign, size_t n) {
    HalvesOfPair pair;
    for (size_t k = 0; k < 2; ++k) {
      pair.halves[k].g = Eigen::VectorXd::Zero(model + 2);
      pair.halves[k].H = Eigen::MatrixXd::Zero(model + 2, model + 2);
      pair.halves[k].g[model] = (k == 0 ? 1.0 : sign) * 3e4;
      pair.halves[k].H(model, model) = 1e8;  // 0.1 ms
    }
    pair.whole = pair.halves[0];
    pair.common.setZero();
    return std::vector<HalvesOfPair>(n, pair);
  };
  const Eigen::VectorXd prior = Eigen::VectorXd::Ones(model);
  const FrameTimeTest same = TestFrameTimes(make(1.0, 100), {}, prior);
  EXPECT_EQ(same.pairs, 100);
  EXPECT_NEAR(same.times.sigmas, 10.0, 1e-9);
  EXPECT_NEAR(same.times.sum, 100.0 * 9e8 / (1e8 + std::pow(kTimesPriorS, -2.0)), 1e-6);
  EXPECT_NEAR(same.times.p_value, std::exp(-50.0), 1e-25);
  EXPECT_NEAR(TestFrameTimes(make(-1.0, 100), {}, prior).times.p_value, 1.0, 1e-9);
  // 2^-n of sums are as large, which n signs can tell.
  EXPECT_EQ(TestFrameTimes(make(1.0, kLeastPairsOfHalves - 1), {}, prior).times.p_value, 1.0);
  EXPECT_LT(TestFrameTimes(make(1.0, kLeastPairsOfHalves), {}, prior).times.p_value, 1e-4);
  EXPECT_EQ(TestFrameTimes({}, {}, prior).times.p_value, 1.0);
}

}  // namespace
}  // namespace camgyro
