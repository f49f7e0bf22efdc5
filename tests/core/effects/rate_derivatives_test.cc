#include "core/effects/rate_derivatives.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

namespace camgyro {
namespace {

// A second of readings about three axes, each a tone, with noise.
EffectSetup Tones(double rate_hz, const Eigen::Vector3d& frequency_hz, double noise_rad_s) {
  auto gyro = std::make_shared<SensorSamples>();
  const auto count = static_cast<Eigen::Index>(std::llround(rate_hz)) + 1;
  gyro->values.resize(3, count);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (Eigen::Index i = 0; i < count; ++i) {
    gyro->times_s.push_back(10.0 + static_cast<double>(i) / rate_hz);
    const double t = static_cast<double>(i) / rate_hz;
    for (int axis = 0; axis < 3; ++axis) {
      gyro->values(axis, i) =
          std::sin(2.0 * M_PI * frequency_hz[axis] * t) + noise_rad_s * normal(random);
    }
  }
  EffectSetup setup;
  setup.gyro = gyro;
  return setup;
}

TEST(RateDerivatives, SeeFourHertzWithin3In1000) {
  const Eigen::Vector3d frequency_hz(1.0, 2.5, 4.0);
  for (const double rate_hz : {100.0, 200.0, 1000.0}) {
    const EffectSetup setup = Tones(rate_hz, frequency_hz, 0.0);
    const RateDerivatives rates(setup);
    for (double t = 0.1; t < 0.9; t += 0.01) {
      const Eigen::Index at = rates.IndexAt(10.0 + t);
      const double sampled_s = setup.gyro->times_s[static_cast<size_t>(at)] - 10.0;
      const RateDerivatives::Coefficients found = rates.At(at);
      for (int axis = 0; axis < 3; ++axis) {
        const double w = 2.0 * M_PI * frequency_hz[axis];
        EXPECT_NEAR(found(1, axis), w * std::cos(w * sampled_s), 0.003 * w);
        EXPECT_NEAR(2.0 * found(2, axis), -w * w * std::sin(w * sampled_s), 0.003 * w * w);
      }
    }
  }
}

// At 200 Hz, of white noise of 0.002 rad/s: 25.1 / s and 3267 / s^2 of it by the weights' norm.
TEST(RateDerivatives, LetThroughAsMuchNoiseAsTheirWeightsSay) {
  const EffectSetup setup = Tones(200.0, Eigen::Vector3d::Zero(), 0.002);
  const RateDerivatives rates(setup);
  double first_squared = 0.0, second_squared = 0.0;
  constexpr Eigen::Index kFrom = 8, kTo = 193;
  for (Eigen::Index i = kFrom; i < kTo; ++i) {
    first_squared += rates.At(i).row(1).squaredNorm() / (3.0 * (kTo - kFrom));
    second_squared += 4.0 * rates.At(i).row(2).squaredNorm() / (3.0 * (kTo - kFrom));
  }
  EXPECT_NEAR(std::sqrt(first_squared), 25.1 * 0.002, 0.15 * 25.1 * 0.002);
  EXPECT_NEAR(std::sqrt(second_squared), 3267.0 * 0.002, 0.15 * 3267.0 * 0.002);
}

TEST(RateDerivatives, AreZeroAtTheEndsAndNotPossibleOfSlowGyros) {
  const EffectSetup setup = Tones(200.0, Eigen::Vector3d::Constant(2.0), 0.0);
  const RateDerivatives rates(setup);
  EXPECT_EQ(rates.IndexAt(11.001), -1);
  EXPECT_TRUE(rates.At(0).isZero(0.0));
  EXPECT_TRUE(rates.At(200).isZero(0.0));
  EXPECT_FALSE(rates.At(8).isZero(0.0));
  EXPECT_TRUE(RateDerivatives::Possible(setup));
  EXPECT_FALSE(RateDerivatives::Possible(Tones(30.0, Eigen::Vector3d::Constant(2.0), 0.0)));
}

}  // namespace
}  // namespace camgyro
