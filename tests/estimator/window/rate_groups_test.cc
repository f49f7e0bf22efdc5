#include "estimator/window/rate_groups.h"

#include <gmock/gmock.h>

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

}  // namespace
}  // namespace camgyro
