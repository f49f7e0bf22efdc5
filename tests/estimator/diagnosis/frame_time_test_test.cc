#include "estimator/diagnosis/frame_time_test.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace camgyro {
namespace {

struct Truth {
  double spread_s = 0.0;
  double level = 1.0;        // variance of the scores over what their information says
  double tails = 0.0;        // share of pairs with nine times the variance
  double block_level = 0.0;  // logarithmic standard deviation of the level between blocks
  double turning = 1.0;      // largest over smallest speed of turning, logarithm
};

// Pairs of neighbours in blocks, as a camera leaves them that turns now fast, now slowly: times are
// told to some 0.3 ms.
Scores DrawScores(const Truth& truth, uint64_t seed, int blocks = 16, int pairs = 12) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Scores scores;
  for (int b = 0; b < blocks; ++b) {
    BlockScore block;
    block.pairs = pairs;
    block.time_s = b;
    scores.blocks.push_back(block);
    const double block_factor = std::exp(0.5 * truth.block_level * normal(random));
    Eigen::VectorXd offsets(pairs + 1);
    for (double& offset : offsets) offset = truth.spread_s * normal(random);
    for (int p = 0; p < pairs; ++p) {
      const double speed = std::exp(truth.turning * (2.0 * uniform(random) - 1.0));
      Eigen::Matrix2d L;
      L << 1.0, -0.9, 0.2, 0.1;
      L *= speed / 0.3e-3;
      const double wild = uniform(random) < truth.tails ? 3.0 : 1.0;
      const double sigma = std::sqrt(truth.level) * block_factor * wild;
      const Eigen::Vector2d measured =
          L * offsets.segment<2>(p) + sigma * Eigen::Vector2d(normal(random), normal(random));
      PairScore pair;
      pair.block = b;
      pair.times = {100 * b + p, 100 * b + p + 1, -L.transpose() * measured, L.transpose() * L};
      scores.pairs.push_back(pair);
    }
  }
  return scores;
}

// Counts of small p-values in 400 recordings without jitter stay what they should be, also where
// the noise is larger than declared, has tails, or differs from block to block.
TEST(FrameTimeTest, IsCalibratedWithoutJitter) {
  for (const Truth& truth :
       {Truth{}, Truth{0.0, 2.0}, Truth{0.0, 1.0, 0.1}, Truth{0.0, 1.3, 0.05, 0.3}}) {
    SCOPED_TRACE(truth.level + truth.tails);
    int below_5 = 0, below_03 = 0;
    for (uint64_t seed = 0; seed < 400; ++seed) {
      const FrameTimeTest test = TestFrameTimes(DrawScores(truth, seed));
      EXPECT_EQ(test.dof, 1);
      if (test.p_value < 0.05) ++below_5;
      if (test.p_value < 0.0003) ++below_03;
    }
    // 20 and 0.12 are expected; four and more of their standard deviations.
    EXPECT_LT(below_5, 20 + 18);
    EXPECT_LT(below_03, 3);
  }
}

TEST(FrameTimeTest, FindsJitterWithItsSigma) {
  double sum_sq = 0.0;
  constexpr int kSeeds = 50;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Scores scores = DrawScores({1e-3, 1.5}, seed);
    const FrameTimeTest test = TestFrameTimes(scores);
    EXPECT_LT(test.p_value, 1e-4) << seed;
    const FrameTimeSpread& found = test.most_likely;
    EXPECT_NEAR(found.level, 1.5, 0.8);
    sum_sq += std::pow((found.spread_s - 1e-3) / found.sigma_s, 2);
    // Another recording of the same device is more likely with it.
    double gain = 0.0;
    for (const double g : GainOfSpread(DrawScores({1e-3, 1.5}, seed + 1000), found)) gain += g;
    EXPECT_GT(gain, 0.0) << seed;
    double loss = 0.0;
    for (const double g : GainOfSpread(DrawScores({}, seed + 1000), found)) loss += g;
    EXPECT_LT(loss, 0.0) << seed;
  }
  // chi-square of 50 has a standard deviation of 0.2 of it.
  EXPECT_NEAR(sum_sq / kSeeds, 1.0, 0.8);
}

// A noise that is alike at all speeds of turning is not jitter, however large.
TEST(FrameTimeTest, NeedsAMotionThatTurnsNowFastNowSlowly) {
  Truth even;
  even.spread_s = 1e-3;
  even.turning = 0.0;
  int named = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    if (TestFrameTimes(DrawScores(even, seed)).p_value < 1e-3) ++named;
  }
  // The second direction of a pair, told ten times worse, is what is left to tell.
  EXPECT_LT(named, 20);
  EXPECT_EQ(TestFrameTimes(DrawScores({1e-3}, 1, 3)).dof, 0);  // too few blocks
}

}  // namespace
}  // namespace camgyro
