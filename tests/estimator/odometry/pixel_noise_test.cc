#include "estimator/odometry/pixel_noise.h"

#include <gtest/gtest.h>

#include <random>

namespace camgyro {
namespace {

using Eigen::Vector2d;

// Residuals of 500 landmarks of 8 sightings less their mean, which a landmark takes away.
PixelNoise NoiseOf(bool adds_up, bool tracks_drift) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, 0.5);
  PixelNoise noise;
  for (int landmark = 0; landmark < 500; ++landmark) {
    std::vector<Vector2d> residuals(8, Vector2d::Zero());
    Vector2d mean = Vector2d::Zero();
    for (size_t i = 0; i < residuals.size(); ++i) {
      const double u = normal(random), v = normal(random);
      residuals[i] = Vector2d(u, v);
      if (adds_up && i > 0) residuals[i] += residuals[i - 1];
      mean += residuals[i] / 8.0;
    }
    if (!tracks_drift) {
      for (Vector2d& residual : residuals) residual -= mean;
    }
    noise.Add(residuals, tracks_drift);
  }
  return noise;
}

TEST(PixelNoise, KnowsItsSigma) {
  // One sighting of eight is taken by the mean: 2 degrees of freedom of each landmark.
  EXPECT_NEAR(NoiseOf(false, false).SigmaPx(2.0 * 500), 0.5, 0.01);
  const PixelNoise steps = NoiseOf(false, true);
  EXPECT_EQ(steps.size(), 7u * 500);
  EXPECT_NEAR(steps.SigmaPx(0.0), 0.5, 0.01);
}

TEST(PixelNoise, CorrelationTellsIndependentNoiseFromWhatAddsUp) {
  // Of n independent values less their mean: -1 / (n - 1), here -0.14.
  EXPECT_NEAR(NoiseOf(false, false).Correlation(), -1.0 / 7.0, 0.03);
  // Of a random walk of 8 values with unit steps, less its mean: the variances are
  // (n^2 - 1) / (6 n) = 1.3125 in the mean, and 2.1875 at both ends; a step of 1 = v + v' - 2 c
  // between neighbours makes their covariances 0.6875 in the mean.
  EXPECT_NEAR(NoiseOf(true, false).Correlation(), 0.6875 / 1.3125, 0.03);
  EXPECT_EQ(NoiseOf(true, true).Correlation(), 0.0);
}

TEST(PixelNoise, TracksThatAreTooShortSayNothingOfCorrelation) {
  PixelNoise noise;
  noise.Add(std::vector<Vector2d>(4, Vector2d(1.0, 0.0)), false);
  EXPECT_EQ(noise.Correlation(), 0.0);
  EXPECT_EQ(noise.size(), 4u);
}

}  // namespace
}  // namespace camgyro
