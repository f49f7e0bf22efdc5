#include "estimator/start/scan_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace camgyro {
namespace {

constexpr double kSpacing = 0.1, kTrue = 0.43;
constexpr int kPairs = 400;

// Squared residuals of two axes with noise of 1, and what a wrong x adds to them.
ScanPoint PointAt(double x, int seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  ScanPoint point;
  point.x = x;
  point.noise = 1.0;
  for (int i = 0; i < kPairs; ++i) {
    const double signal = 3.0 * std::sin(0.7 * i) * (x - kTrue);
    const double one = normal(random) + signal, two = normal(random);
    point.squares.push_back(one * one + two * two);
    point.blocks.push_back(i * kScanBlocks / kPairs);
  }
  return point;
}

// Ten points, out of order, of the same noise.
ScanCurve CurveOf(int seed) {
  std::vector<ScanPoint> points;
  for (const int k : {3, 1, 4, 0, 5, 9, 2, 6, 8, 7}) points.push_back(PointAt(kSpacing * k, seed));
  return ScanCurve(std::move(points), kSpacing, /*means_of=*/1.0);
}

TEST(ScanCurve, TheMinimumIsAsFarOffAsItSays) {
  double chi_square = 0.0;
  constexpr int kRuns = 50;
  for (int seed = 0; seed < kRuns; ++seed) {
    const auto [x, sigma] = CurveOf(seed).Minimum();
    EXPECT_LT(sigma, 0.1) << seed;
    chi_square += std::pow((x - kTrue) / sigma, 2) / kRuns;
  }
  // 50 values: sigma 0.2 about 1. The losses are truncated, and the sigma is that of least squares.
  EXPECT_GT(chi_square, 0.4);
  EXPECT_LT(chi_square, 1.6);
}

TEST(ScanCurve, PointsAreSortedAndBlocksHaveTheirLosses) {
  const ScanCurve curve = CurveOf(0);
  ASSERT_EQ(curve.points().size(), 10u);
  for (size_t k = 1; k < curve.points().size(); ++k) {
    EXPECT_GT(curve.points()[k].x, curve.points()[k - 1].x);
  }
  EXPECT_NEAR(curve.Best().x, kTrue, 1.5 * kSpacing);
  for (const ScanPoint& point : curve.points()) {
    EXPECT_EQ(point.loss.size(), kScanBlocks);
    EXPECT_GE(point.loss.sum(), curve.Best().loss.sum());
  }
}

TEST(ScanCurve, AMinimumAtTheEndIsNone) {
  std::vector<ScanPoint> points;
  for (const int k : {5, 6, 7, 8, 9}) points.push_back(PointAt(kSpacing * k, 0));
  const auto [x, sigma] = ScanCurve(std::move(points), kSpacing, 1.0).Minimum();
  EXPECT_EQ(x, kSpacing * 5);
  EXPECT_EQ(sigma, 1.0);
}

TEST(ScanCurve, PairsWithoutARotationCountAsOutliers) {
  std::vector<ScanPoint> points;
  for (const int k : {3, 4, 5}) points.push_back(PointAt(kSpacing * k, 0));
  points[1].squares.resize(kPairs / 2);  // the best one, of half of the pairs
  points[1].blocks.resize(kPairs / 2);
  const ScanCurve curve(std::move(points), kSpacing, 1.0);
  EXPECT_NE(curve.Best().x, kSpacing * 4);
  EXPECT_LT(curve.RunnerUpRatio(1.5 * kSpacing), 1.0);
  EXPECT_EQ(curve.RunnerUpRatio(10.0), 1.0);  // nothing is so far away
}

}  // namespace
}  // namespace camgyro
