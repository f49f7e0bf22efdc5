#include "estimator/window/noise_scale.h"

#include <gmock/gmock.h>

#include <random>

#include "estimator/window/residuals/all_residuals.h"

namespace camgyro {
namespace {

std::vector<std::vector<double>> Gaussian(double sigma, int per_pair) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> normal(0.0, sigma);
  std::vector<std::vector<double>> residuals(300);
  for (auto& pair : residuals) {
    for (int i = 0; i < per_pair; ++i) pair.push_back(normal(generator));
  }
  return residuals;
}

TEST(NoiseScale, OfPixelsIsWhatTheResidualsShowAndNeverNothing) {
  const NoiseScale noise(ByTransfer().facts());
  EXPECT_NEAR(noise.Next(Gaussian(1.4, 40), 0.5), 0.7, 0.02);
  EXPECT_DOUBLE_EQ(noise.Next(Gaussian(1e-5, 40), 0.1), NoiseScale::kLeastPx);
  EXPECT_DOUBLE_EQ(noise.Next(Gaussian(1e-5, 40), 10.0), 1e-3 * 10.0);  // not all at once
}

// Turns over 0.1 s of a gyro of 100 Hz and 3 mrad/s: 9.5e-5 rad. Of a misfit with that and 2e-4 rad
// of the attitudes' own, the rates take a share, which is given back.
TEST(NoiseScale, OfAttitudesLeavesTheGyroItsShare) {
  EstimationInput input;
  for (int i = 0; i < 100; ++i) input.rates.push_back({0.01 * i, Eigen::Vector3d::Zero(), false});
  std::vector<TimedPair> pairs(5);
  for (TimedPair& pair : pairs) pair.time_b_s = 0.1;
  const NoiseScale noise(ByAttitudes().facts(), input, pairs, Eigen::Vector3d::Constant(0.003));
  const double gyro = 0.003 * std::sqrt(0.01 * 0.1), own = 2e-4;
  // What is left of the misfit at that scale, in units of it.
  const double share = own * own / (own * own + gyro * gyro);
  const double left = share * std::sqrt(own * own + gyro * gyro) / own;
  EXPECT_NEAR(noise.Next(Gaussian(left, 300), own), own, 0.05 * own);
  EXPECT_NEAR(noise.Next(Gaussian(1e-9, 3), own), gyro / 3.0, 1e-9);
}

}  // namespace
}  // namespace camgyro
