#include "estimator/window/frame_wander.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <random>

namespace camgyro {
namespace {

constexpr double kFrameS = 1.0 / 30.0;

int64_t Number(int frame) { return std::llround(1e9 * kFrameS * frame); }

Eigen::VectorXd DrawOffsets(int frames, const FrameWander& wander, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd offsets(frames);
  const double a = wander.time_s > 0.0 ? std::exp(-kFrameS / wander.time_s) : 0.0;
  double slow = normal(*random);
  for (double& offset : offsets) {
    offset = wander.white_s * normal(*random) + wander.slow_s * slow;
    slow = a * slow + std::sqrt(1.0 - a * a) * normal(*random);
  }
  return offsets;
}

// Neighbours, of whose frames each pair says the same, but tells their difference better.
std::vector<PairTimes> Measure(const Eigen::VectorXd& offsets, double sigma_s,
                               std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  std::vector<PairTimes> pairs;
  for (int i = 0; i + 1 < offsets.size(); ++i) {
    Eigen::Matrix2d L;
    L << 1.0, -1.0, 0.3, 0.3;
    L /= sigma_s;
    const Eigen::Vector2d measured =
        L * offsets.segment<2>(i) + Eigen::Vector2d{normal(*random), normal(*random)};
    pairs.push_back({Number(i), Number(i + 1), -L.transpose() * measured, L.transpose() * L});
  }
  return pairs;
}

// Against dense matrices: scores are Gaussian with covariance W + W K W, and the information of a
// shift is that of (K + W^-1)^-1.
TEST(FrameWander, LikelihoodAndVarianceAreThoseOfDenseMatrices) {
  constexpr int kFrames = 9;
  std::mt19937_64 random(1);
  const FrameWander wander{1.5e-3, 3e-3, 0.2};
  const std::vector<PairTimes> pairs =
      Measure(DrawOffsets(kFrames, wander, &random), 1e-3, &random);
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(kFrames, kFrames), K = W;
  Eigen::VectorXd score = Eigen::VectorXd::Zero(kFrames);
  for (int i = 0; i + 1 < kFrames; ++i) {
    W.block<2, 2>(i, i) += pairs[static_cast<size_t>(i)].information;
    score.segment<2>(i) += pairs[static_cast<size_t>(i)].score;
  }
  for (int i = 0; i < kFrames; ++i) {
    for (int k = 0; k < kFrames; ++k) {
      K(i, k) = std::pow(wander.slow_s, 2) * std::exp(-kFrameS * std::abs(i - k) / wander.time_s);
      if (i == k) K(i, k) += std::pow(wander.white_s, 2);
    }
  }
  const auto two_log_density = [&](const Eigen::MatrixXd& prior) {
    const Eigen::MatrixXd C = W + W * prior * W;
    return -score.dot(C.ldlt().solve(score)) - C.ldlt().vectorD().array().log().sum();
  };
  EXPECT_NEAR(TwoLogLikelihood(pairs, wander),
              two_log_density(K) - two_log_density(Eigen::MatrixXd::Zero(kFrames, kFrames)), 1e-5);
  const Eigen::MatrixXd seen = K + W.inverse();
  const double information = seen.ldlt().solve(Eigen::VectorXd::Ones(kFrames)).sum();
  EXPECT_NEAR(VarianceOfShift(pairs, wander) * information, 1.0, 1e-6);
  const Eigen::MatrixXd C = (K.inverse() + W).inverse();
  const Eigen::VectorXd mean = -C * score;
  const std::vector<FrameOffset> offsets = OffsetsOf(pairs, wander);
  ASSERT_EQ(offsets.size(), kFrames);
  for (int i = 0; i < kFrames; ++i) {
    const FrameOffset& offset = offsets[static_cast<size_t>(i)];
    EXPECT_EQ(offset.frame, Number(i));
    EXPECT_NEAR(offset.offset_s, mean[i], 1e-9);
    EXPECT_NEAR(offset.sigma_s, std::sqrt(C(i, i)), 1e-9);
  }
  FrameWander white;
  white.white_s = 2e-3;
  EXPECT_NEAR(TwoLogLikelihood(pairs, white), TwoLogLikelihood(pairs, 2e-3), 1e-9);
  const std::vector<FrameOffset> same = OffsetsOf(pairs, white), as = OffsetsOf(pairs, 2e-3);
  for (size_t i = 0; i < same.size(); ++i) {
    EXPECT_EQ(same[i].frame, as[i].frame);
    EXPECT_NEAR(same[i].offset_s, as[i].offset_s, 1e-9);
    EXPECT_NEAR(same[i].sigma_s, as[i].sigma_s, 1e-9);
  }
}

// The mean of 20 s of wandering offsets is as far from zero as the variance of a shift says; that
// of white offsets is several times too small.
TEST(FrameWander, SaysHowFarTheMeanIsKnown) {
  constexpr int kFrames = 600, kSeeds = 40;
  const FrameWander truth{1.5e-3, 3e-3, 1.5};
  double with = 0.0, without = 0.0;
  int found = 0;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const Eigen::VectorXd offsets = DrawOffsets(kFrames, truth, &random);
    const std::vector<PairTimes> pairs = Measure(offsets, 1e-3, &random);
    FrameWander white;
    white.white_s = MostLikelySpread(pairs).value_s;
    const FrameWander wander = MostLikelyWander(pairs, white.white_s);
    found += wander.slow_s > 0.0 ? 1 : 0;
    EXPECT_NEAR(wander.white_s, 1.5e-3, 0.4e-3) << seed;
    with += std::pow(offsets.mean(), 2) / VarianceOfShift(pairs, wander);
    without += std::pow(offsets.mean(), 2) / VarianceOfShift(pairs, white);
  }
  EXPECT_EQ(found, kSeeds);
  // A chi-square of 40 has a standard deviation of 0.22 of it. The slow part's size and time are
  // known from some seven times its length: the variance is, to a half, and too small rather than
  // too large.
  EXPECT_GT(with / kSeeds, 0.4);
  EXPECT_LT(with / kSeeds, 2.2);
  EXPECT_GT(without / kSeeds, 10.0);
}

// Frames of which the matches say little lie near their neighbours, with a sigma that is right;
// held for white, they are drawn to zero.
TEST(FrameWander, OffsetsAreNearTheirNeighbours) {
  constexpr int kFrames = 300, kSeeds = 10;
  const FrameWander truth{0.5e-3, 3e-3, 1.5};
  double with_sq = 0.0, without_sq = 0.0, in_sigmas_sq = 0.0;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const Eigen::VectorXd offsets = DrawOffsets(kFrames, truth, &random);
    const std::vector<PairTimes> pairs = Measure(offsets, 2e-3, &random);
    const double spread_s = MostLikelySpread(pairs).value_s;
    const FrameWander wander = MostLikelyWander(pairs, spread_s);
    const auto with = OffsetsOf(pairs, wander), without = OffsetsOf(pairs, spread_s);
    for (size_t i = 0; i < with.size(); ++i) {
      const double true_s = offsets[static_cast<Eigen::Index>(i)];
      with_sq += std::pow(with[i].offset_s - true_s, 2);
      without_sq += std::pow(without[i].offset_s - true_s, 2);
      in_sigmas_sq += std::pow((with[i].offset_s - true_s) / with[i].sigma_s, 2);
    }
  }
  std::printf("rms %.2f instead of %.2f ms\n", 1e3 * std::sqrt(with_sq / kFrames / kSeeds),
              1e3 * std::sqrt(without_sq / kFrames / kSeeds));
  EXPECT_LT(with_sq, 0.6 * without_sq);
  EXPECT_NEAR(in_sigmas_sq / (kFrames * kSeeds), 1.0, 0.3);
}

TEST(FrameWander, WhiteOffsetsDoNotWander) {
  int found = 0;
  for (uint64_t seed = 0; seed < 100; ++seed) {
    std::mt19937_64 random(seed);
    FrameWander white;
    white.white_s = 2e-3;
    const std::vector<PairTimes> pairs = Measure(DrawOffsets(200, white, &random), 1e-3, &random);
    const double spread_s = MostLikelySpread(pairs).value_s;
    const FrameWander wander = MostLikelyWander(pairs, spread_s);
    if (wander.slow_s > 0.0) {
      ++found;
    } else {
      EXPECT_EQ(wander.white_s, spread_s);
      EXPECT_EQ(wander.time_s, 0.0);
    }
  }
  EXPECT_LE(found, 4);  // one is to be expected; more than four have a chance of 0.3 %
}

TEST(FrameWander, NothingIsNoWander) {
  EXPECT_EQ(MostLikelyWander({}, 1e-3).slow_s, 0.0);
  EXPECT_EQ(MostLikelyWander({}, kLeastSpreadS).slow_s, 0.0);
}

}  // namespace
}  // namespace camgyro
