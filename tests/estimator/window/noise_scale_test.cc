#include "estimator/window/noise_scale.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <vector>

#include "estimator/window/residuals/all_residuals.h"

namespace camgyro {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;

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

TEST(NoiseScale, FactorsOfPairsThatDifferByChanceAreOne) {
  const NoiseScale noise(ByTransfer().facts());
  const std::vector<double> ones(300, 1.0);
  std::vector<std::vector<double>> differences = Gaussian(1.4, 40);
  for (const double factor : noise.FactorsOfPairs(differences, ones)) {
    EXPECT_NEAR(factor, 1.0, 0.03);
  }
  differences[7].clear();  // a ray is missing
  differences[8].resize(1);
  for (const double factor : noise.FactorsOfPairs(differences, ones)) {
    EXPECT_NEAR(factor, 1.0, 0.03);
  }
}

// What a model lacks is the same for neighbours; each match is in one difference.
TEST(NoiseScale, DifferencesOfNeighboursAreNoiseOnly) {
  std::vector<Match> matches(4);
  matches[0].px_a = {10.0, 10.0};
  matches[1].px_a = {500.0, 10.0};
  matches[2].px_a = {510.0, 20.0};
  matches[3].px_a = {15.0, 10.0};
  EXPECT_THAT(NeighbourDifferences(matches, {5.0, -3.0, -3.0, 5.0}), ElementsAre(0.0, 0.0));
  EXPECT_THAT(NeighbourDifferences(matches, {5.0, 0.0, 0.0, 4.0}),
              ElementsAre(DoubleNear(std::sqrt(0.5), 1e-12), 0.0));
  EXPECT_TRUE(NeighbourDifferences(matches, {}).empty());
}

// Residuals are in sigmas of the factors so far, whatever these are.
TEST(NoiseScale, FactorsOfPairsFollowTheirNoise) {
  constexpr double kScatter = 0.4;
  constexpr int kMatches = 100;
  const NoiseScale noise(ByTransfer().facts());
  std::vector<std::vector<double>> residuals = Gaussian(1.0, kMatches);
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0.0, kScatter);
  std::vector<double> truth, now;
  double mean = 0.0;
  for (auto& pair : residuals) {
    truth.push_back(std::exp(normal(generator)));
    now.push_back(std::exp(normal(generator)));
    mean += std::log(truth.back()) / static_cast<double>(residuals.size());
    for (double& r : pair) r *= truth.back() / now.back();
  }
  const std::vector<double> factors = noise.FactorsOfPairs(residuals, now);
  double error_sq = 0.0, log_sum = 0.0;
  for (size_t i = 0; i < factors.size(); ++i) {
    error_sq += std::pow(std::log(factors[i] / truth[i]) + mean, 2);
    log_sum += std::log(factors[i]);
  }
  // A median of 100 tells a scale to 12 %.
  EXPECT_LT(std::sqrt(error_sq / static_cast<double>(factors.size())), 0.13);
  EXPECT_NEAR(log_sum, 0.0, 1e-9);
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
