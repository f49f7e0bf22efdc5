#include "estimator/diagnosis/score_test.h"

#include <gmock/gmock.h>

#include <random>

#include "estimator/diagnosis/step_search.h"

namespace camgyro {
namespace {

// Blocks of a linear model: r = J x + noise, one pair per block part; parameters: a state of which
// only focal length and delay show, and three candidates.
Scores LinearScores(uint64_t seed, const Eigen::VectorXd& truth, double correlated = 0.0) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Scores scores;
  scores.num_model = kStateSize;
  const Eigen::Index size = kStateSize + 3;
  for (int b = 0; b < 12; ++b) {
    BlockScore block;
    block.time_s = b;
    block.g.setZero(size);
    block.H.setZero(size, size);
    const double common = correlated * normal(generator);
    for (int p = 0; p < 20; ++p) {
      PairScore pair;
      pair.block = b;
      pair.time_s = b + p / 20.0;
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(30, size);
      Eigen::VectorXd r(30);
      for (int i = 0; i < 30; ++i) {
        J(i, kStateFocal) = normal(generator);
        J(i, kStateDelay) = normal(generator);
        for (int k = 0; k < 3; ++k) {
          J(i, kStateSize + k) = normal(generator) + 0.5 * J(i, kStateFocal);
        }
        r[i] = normal(generator) + common * J(i, kStateSize) - J.row(i).dot(truth);
      }
      pair.g = J.transpose() * r;
      pair.H = (J.transpose() * J).topLeftCorner(kStateSize, kStateSize);
      pair.chi2 = r.squaredNorm();
      pair.residuals = 30;
      block.g += pair.g;
      block.H += J.transpose() * J;
      block.chi2 += pair.chi2;
      block.residuals += 30;
      ++block.pairs;
      scores.pairs.push_back(std::move(pair));
    }
    scores.blocks.push_back(std::move(block));
  }
  return scores;
}

Eigen::VectorXd WeakPrior() { return Eigen::VectorXd::Constant(kStateSize + 3, 1e-4); }
const std::vector<int> kCandidates = {kStateSize, kStateSize + 1, kStateSize + 2};

TEST(ScoreTest, TailsAreThoseOfTheTables) {
  EXPECT_NEAR(ChiSquareTail(3.841, 1.0), 0.05, 1e-4);
  EXPECT_NEAR(ChiSquareTail(31.264, 11.0), 0.001, 1e-5);
  EXPECT_NEAR(FTail(4.747, 1.0, 12.0), 0.05, 1e-4);
  EXPECT_NEAR(FTail(3.490, 3.0, 12.0), 0.05, 1e-4);
}

// What the state explains is not an effect: a wrong focal length and delay do not show.
TEST(ScoreTest, MergesNeighbouringBlocksOfTwoShares) {
  Scores first = LinearScores(1, Eigen::VectorXd::Zero(kStateSize + 3)), second = first;
  for (BlockScore& block : second.blocks) block.time_s += 0.5;
  for (PairScore& pair : second.pairs) pair.time_s += 0.5;
  const Scores both = MergeShares(first, second);
  ASSERT_EQ(both.blocks.size(), 12u);
  EXPECT_EQ(both.pairs.size(), 480u);
  for (size_t b = 0; b < 12; ++b) {
    EXPECT_TRUE(both.blocks[b].g.isApprox(2.0 * first.blocks[b].g));
    EXPECT_TRUE(both.blocks[b].H.isApprox(2.0 * first.blocks[b].H));
    EXPECT_EQ(both.blocks[b].pairs, 40);
    EXPECT_EQ(both.blocks[b].residuals, 1200);
  }
  for (size_t i = 0; i < both.pairs.size(); ++i) {
    if (i > 0) {
      EXPECT_LE(both.pairs[i - 1].time_s, both.pairs[i].time_s);
    }
    // Pair times of a block run from its number on, and half a second later in the second share.
    EXPECT_NEAR(both.pairs[i].time_s - both.pairs[i].block, 0.73, 0.74);
  }
  const Scores state = FirstColumns(both, kStateSize);
  EXPECT_EQ(state.blocks[0].g.size(), kStateSize);
  EXPECT_EQ(state.blocks[0].H.cols(), kStateSize);
  EXPECT_EQ(state.pairs[0].g.size(), kStateSize);
  EXPECT_EQ(state.pairs[0].g, both.pairs[0].g.head<kStateSize>());
}

TEST(ScoreTest, IsUniformUnderTheModelWhateverTheState) {
  Eigen::VectorXd truth = Eigen::VectorXd::Zero(kStateSize + 3);
  truth[kStateFocal] = 0.5;
  truth[kStateDelay] = -0.3;
  int below = 0;
  double mean = 0.0;
  constexpr int kRuns = 200;
  for (int seed = 0; seed < kRuns; ++seed) {
    const ScoreTest test = TestColumns(LinearScores(seed, truth), kCandidates, WeakPrior());
    EXPECT_EQ(test.dof, 3);
    below += test.p_value < 0.1 ? 1 : 0;
    mean += test.p_value / kRuns;
  }
  // The inflation is at least one, so that the test may be conservative, not the contrary.
  EXPECT_LT(below, 30);  // 20 expected, 3 sigma above 32
  EXPECT_GT(below, 3);
  EXPECT_NEAR(mean, 0.55, 0.08);
}

TEST(ScoreTest, FindsAnEffectWithItsSize) {
  Eigen::VectorXd truth = Eigen::VectorXd::Zero(kStateSize + 3);
  truth[kStateSize + 1] = 0.1;  // sigma 0.012
  const ScoreTest test = TestColumns(LinearScores(1, truth), kCandidates, WeakPrior());
  EXPECT_LT(test.p_value, 1e-6);
  EXPECT_NEAR(test.estimate[1], 0.1, 4.0 * std::sqrt(test.covariance(1, 1)));
  EXPECT_NEAR(std::sqrt(test.covariance(1, 1)), 0.012, 0.003);
}

// Scores that a block has in common (what jitters from block to block) raise the bar.
TEST(ScoreTest, InflatesForWhatBlocksHaveInCommon) {
  const Eigen::VectorXd truth = Eigen::VectorXd::Zero(kStateSize + 3);
  int below = 0;
  for (int seed = 0; seed < 100; ++seed) {
    const ScoreTest test = TestColumns(LinearScores(seed, truth, 0.1), {kStateSize}, WeakPrior());
    EXPECT_GT(test.inflation, 1.5);
    below += test.p_value < 0.05 ? 1 : 0;
  }
  EXPECT_LT(below, 13);  // without the inflation: about half of them
}

std::vector<ScoreTest> TestsWithScatter(double variance, double spread) {
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal;
  std::vector<ScoreTest> tests(25);
  for (size_t i = 0; i < tests.size(); ++i) {
    const int dof = 10 + static_cast<int>(i);
    std::chi_squared_distribution<double> chi2(dof);
    tests[i].dof = 1;
    tests[i].scatter = {variance * std::exp(spread * normal(generator)) * chi2(generator) / dof,
                        static_cast<double>(dof)};
  }
  return tests;
}

TEST(ScoreTest, TakesTheScatterThatTestsHaveInCommon) {
  const Scatter alike = UsualScatter(TestsWithScatter(1.8, 0.0));
  EXPECT_NEAR(alike.variance, 1.8, 0.25);
  EXPECT_GT(alike.dof, 20.0);
  // Log variances that differ by one more than they should: var = trigamma(dof / 2), dof 2.9.
  const Scatter unlike = UsualScatter(TestsWithScatter(1.8, 1.0));
  EXPECT_GT(unlike.dof, 1.5);
  EXPECT_LT(unlike.dof, 6.0);
  EXPECT_EQ(UsualScatter({}).dof, 0.0);
}

// Twelve blocks alone cannot say that four sigmas are not chance; with the usual scatter they can,
// and without an effect the test stays uniform.
TEST(ScoreTest, TellsMoreOnceTheUsualScatterIsKnown) {
  Eigen::VectorXd truth = Eigen::VectorXd::Zero(kStateSize + 3);
  truth[kStateSize] = 0.055;  // sigma 0.012
  const Scatter usual{1.0, 50.0};
  int below = 0;
  double alone = 0.0, moderated = 0.0;  // mean log10 p
  for (int seed = 0; seed < 100; ++seed) {
    const Scores clean = LinearScores(seed, Eigen::VectorXd::Zero(kStateSize + 3));
    below += TestColumns(clean, {kStateSize}, WeakPrior(), usual).p_value < 0.05 ? 1 : 0;
    const Scores scores = LinearScores(seed, truth);
    alone += std::log10(TestColumns(scores, {kStateSize}, WeakPrior()).p_value) / 100.0;
    moderated += std::log10(TestColumns(scores, {kStateSize}, WeakPrior(), usual).p_value) / 100.0;
  }
  EXPECT_LT(below, 12);  // 5 expected
  EXPECT_LT(moderated, alone - 0.7);
}

TEST(ScoreTest, FindsTheTimeOfAStepOfTheDelay) {
  Scores scores = LinearScores(5, Eigen::VectorXd::Zero(kStateSize + 3));
  for (PairScore& pair : scores.pairs) {
    if (pair.time_s < 7.25) continue;
    const Eigen::VectorXd change = 0.4 * pair.H.col(kStateDelay);
    pair.g.head(kStateSize) -= change;
    scores.blocks[static_cast<size_t>(pair.block)].g.head(kStateSize) -= change;
  }
  const StepSearch found = SearchDelayStep(scores, WeakPrior(), 1.0, {1.0, 50.0});
  EXPECT_LT(found.test.p_value, 1e-4);
  EXPECT_NEAR(found.time_s, 7.25, 0.5);
  EXPECT_NEAR(found.test.estimate[0], 0.4, 0.1);
}

TEST(ScoreTest, AFalseStepIsNotSignificant) {
  int found = 0;
  for (int seed = 0; seed < 60; ++seed) {
    const Scores scores = LinearScores(seed, Eigen::VectorXd::Zero(kStateSize + 3));
    found += SearchDelayStep(scores, WeakPrior(), 1.0).test.p_value < 0.05 ? 1 : 0;
  }
  EXPECT_LE(found, 9);  // 3 expected
}

// What both shares have, either gains by the other's step: half of the statistic. What one has and
// the other has turned round, neither does.
TEST(ScoreTest, AShareGainsByTheOthersStepIfBothHaveTheEffect) {
  Eigen::VectorXd truth = Eigen::VectorXd::Zero(kStateSize + 3);
  truth[kStateSize + 1] = 0.1;
  const std::vector<int> columns = {kStateSize + 1};
  const auto gain_beside_model = [&](const Scores& first, const Scores& second) {
    std::vector<double> gain = GainAcross(first, second, columns, WeakPrior());
    const std::vector<double> without = GainAcross(first, second, {}, WeakPrior());
    EXPECT_EQ(gain.size(), first.blocks.size() + second.blocks.size());
    for (size_t i = 0; i < gain.size(); ++i) gain[i] -= without[i];
    return SumOf(gain);
  };
  const Scores first = LinearScores(1, truth), second = LinearScores(2, truth);
  const Gain gain = gain_beside_model(first, second);
  const double of_alone = TestColumns(first, columns, WeakPrior()).statistic +
                          TestColumns(second, columns, WeakPrior()).statistic;
  EXPECT_NEAR(gain.sum, 0.5 * of_alone, 3.0 * gain.sigma);
  EXPECT_GT(gain.sum, 3.0 * gain.sigma);
  EXPECT_LT(gain_beside_model(first, LinearScores(2, -truth)).sum, 0.0);
}

TEST(ScoreTest, KnowsWhatCannotBeToldApart) {
  Scores scores = LinearScores(7, Eigen::VectorXd::Zero(kStateSize + 3));
  EXPECT_LT(AliasOf(scores, {kStateSize}, {kStateSize + 1}, WeakPrior()), 0.3);
  for (BlockScore& block : scores.blocks) {  // the second candidate is twice the first
    block.H.col(kStateSize + 1) = 2.0 * block.H.col(kStateSize);
    block.H.row(kStateSize + 1) = 2.0 * block.H.row(kStateSize);
  }
  EXPECT_GT(AliasOf(scores, {kStateSize}, {kStateSize + 1}, WeakPrior()), 0.999);
}

}  // namespace
}  // namespace camgyro
