#include "estimator/window/cross_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

namespace camgyro {
namespace {

const Eigen::Vector2d kSize(640.0, 480.0);

// Errors of matches all over the picture: each its own, and beside it those of `sources`, bells of
// this width around places of which each pair has new ones, with this share of the variance.
struct Field {
  int matches = 120;
  double share = 0.0, width_px = 25.0;
};

struct PairErrors {
  std::vector<Match> matches;
  std::vector<double> errors;
};

PairErrors Draw(const Field& field, std::mt19937* rng) {
  constexpr int kSources = 400;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> x(0.0, kSize[0]), y(0.0, kSize[1]);
  struct Source {
    Eigen::Vector2d px;
    double size = 0.0;
  };
  std::vector<Source> sources(kSources);
  for (Source& source : sources) source = {{x(*rng), y(*rng)}, normal(*rng)};
  PairErrors pair;
  // Of the sum of all bells: their density times the integral of a squared bell.
  const double variance = kSources / kSize.prod() * M_PI * field.width_px * field.width_px;
  for (int i = 0; i < field.matches; ++i) {
    Match match;
    match.px_b = {x(*rng), y(*rng)};
    double smooth = 0.0;
    for (const Source& source : sources) {
      const double d = (source.px - match.px_b).norm() / field.width_px;
      smooth += source.size * std::exp(-0.5 * d * d);
    }
    pair.matches.push_back(match);
    pair.errors.push_back(std::sqrt(1.0 - field.share) * normal(*rng) +
                          std::sqrt(field.share / variance) * smooth);
  }
  return pair;
}

struct Found {
  double effect = 1.0;    // what NeighbourCorrelation says
  double variance = 0.0;  // of the pairs' means, over that of independent errors
};

Found FindIn(const Field& field, int pairs, unsigned seed) {
  std::mt19937 rng(seed);
  NeighbourCorrelation correlation;
  double means_sq = 0.0, squares = 0.0;
  for (int i = 0; i < pairs; ++i) {
    const PairErrors pair = Draw(field, &rng);
    correlation.Add(pair.matches, pair.errors, 3.5, kSize);
    double sum = 0.0;
    for (const double error : pair.errors) {
      sum += error;
      squares += error * error;
    }
    means_sq += sum * sum;
  }
  return {correlation.DesignEffect(), means_sq / squares};
}

// Three sigmas come by chance in one recording of a hundred at most.
TEST(NeighbourCorrelation, IsNoneOfIndependentErrors) {
  int by_chance = 0;
  for (unsigned seed = 0; seed < 1000; ++seed) {
    by_chance += FindIn({30}, 10, seed).effect > 1.0 ? 1 : 0;
  }
  std::printf("%d of 1000\n", by_chance);
  EXPECT_LE(by_chance, 10);
}

// The means of pairs scatter by as much more as it says.
TEST(NeighbourCorrelation, SaysHowMuchLessTheMatchesKnow) {
  struct Case {
    double share, width_px, least;
  };
  for (const Case& c : {Case{0.2, 25.0, 1.3}, Case{0.5, 25.0, 1.9}, Case{0.3, 40.0, 2.0}}) {
    SCOPED_TRACE(c.share);
    const Found found = FindIn({120, c.share, c.width_px}, 1000, 7);
    std::printf("%.2f where the means have %.2f\n", found.effect, found.variance);
    EXPECT_GT(found.variance, c.least);
    EXPECT_NEAR(found.effect / found.variance, 1.0, 0.12);
  }
}

// Of a pair, or of the mean of many.
TEST(NeighbourCorrelation, AddsUp) {
  std::mt19937 rng(3);
  NeighbourCorrelation all, sum;
  for (int i = 0; i < 50; ++i) {
    const PairErrors pair = Draw({60, 0.5, 25.0}, &rng);
    all.Add(pair.matches, pair.errors, 3.5, kSize);
    NeighbourCorrelation one;
    one.Add(pair.matches, pair.errors, 3.5, kSize);
    sum += one;
  }
  EXPECT_GT(all.DesignEffect(), 1.3);
  EXPECT_NEAR((sum * 0.5).DesignEffect(), all.DesignEffect(), 1e-9);
}

TEST(NeighbourCorrelation, LeavesWrongMatchesOut) {
  std::mt19937 rng(5);
  NeighbourCorrelation correlation;
  for (int i = 0; i < 50; ++i) {
    PairErrors pair = Draw({60}, &rng);
    for (size_t k = 0; k < 8; ++k) {  // of something that moves
      pair.matches[k].px_b = Eigen::Vector2d(100.0, 100.0) + 2.0 * k * Eigen::Vector2d::Ones();
      pair.errors[k] = 6.0;
    }
    correlation.Add(pair.matches, pair.errors, 3.5, kSize);
  }
  EXPECT_EQ(correlation.DesignEffect(), 1.0);
}

TEST(CrossFit, WidensByBoth) {
  CrossFit fit;
  EXPECT_EQ(fit.inflation(), 1.0);
  fit.own = 100.0;
  fit.expected = 110.0;
  fit.unseen = 121.0;
  EXPECT_NEAR(fit.inflation(), 1.21 * 1.1, 1e-12);
  std::mt19937 rng(3);
  const PairErrors pair = Draw({200, 0.7, 30.0}, &rng);
  fit.neighbours.Add(pair.matches, pair.errors, 3.5, kSize);
  EXPECT_GT(fit.neighbours.DesignEffect(), 1.5);
  EXPECT_NEAR(fit.inflation(), 1.21 * 1.1 * fit.neighbours.DesignEffect(), 1e-12);
  EXPECT_NEAR((fit * 0.5).inflation(), fit.inflation(), 1e-9);
}

}  // namespace
}  // namespace camgyro
