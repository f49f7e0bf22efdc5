#include "frontend/epipolar_misfit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/robust_statistics.h"
#include "tests/frontend/two_view_scene.h"

namespace camgyro {
namespace {

TwoViewScene WalkPast() {
  TwoViewScene scene;
  scene.q_a_b = Eigen::AngleAxisd(0.05, Eigen::Vector3d(0.3, 0.9, 0.2).normalized());
  scene.p_a = {0.2, 0.05, 0.3};
  return scene;
}

double RobustLength(const std::vector<Eigen::Vector2d>& corrections_px) {
  std::vector<double> lengths;
  for (const Eigen::Vector2d& correction : corrections_px) lengths.push_back(correction.norm());
  return kSigmaOfMedian * MedianOr(lengths, -1.0);
}

// The errors of both pictures, across the line, whatever the depths, and with every sixth match
// wrong.
TEST(EpipolarCorrections, AreTheNoiseOfBothPictures) {
  TwoViewScene scene = WalkPast();
  scene.noise_px = 0.3;
  FramePair pair = scene.Make(150, 1);
  EXPECT_NEAR(RobustLength(EpipolarCorrections(pair.matches)), 0.3 * std::sqrt(2.0), 0.08);
  for (size_t i = 0; i < pair.matches.size(); i += 6) {
    pair.matches[i].px_b += Eigen::Vector2d(i % 4 == 0 ? 25.0 : -30.0, i % 5 == 0 ? -20.0 : 40.0);
  }
  EXPECT_NEAR(RobustLength(EpipolarCorrections(pair.matches)), 0.3 * std::sqrt(2.0) * 1.2, 0.12);
}

TEST(EpipolarCorrections, TakeAMatchOntoItsLine) {
  FramePair pair = WalkPast().Make(60, 2);
  pair.matches[7].px_b += Eigen::Vector2d(2.0, -3.0);
  const std::vector<Eigen::Vector2d> corrections_px = EpipolarCorrections(pair.matches);
  ASSERT_EQ(corrections_px.size(), pair.matches.size());
  EXPECT_LT(RobustLength(corrections_px), 1e-3);
  // As far as the line is away: no further than the point was moved.
  EXPECT_GT(corrections_px[7].norm(), 0.1);
  EXPECT_LE(corrections_px[7].norm(), std::hypot(2.0, 3.0) + 1e-3);
  pair.matches[7].px_b += corrections_px[7];
  EXPECT_LT(EpipolarCorrections(pair.matches)[7].norm(), 1e-2);
}

TEST(EpipolarCorrections, OfAFewMatchesAreNone) {
  EXPECT_TRUE(EpipolarCorrections(WalkPast().Make(19, 3).matches).empty());
  EXPECT_TRUE(EpipolarCorrections({}).empty());
}

}  // namespace
}  // namespace camgyro
