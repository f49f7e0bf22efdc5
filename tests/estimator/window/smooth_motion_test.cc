#include "estimator/window/smooth_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace camgyro {
namespace {

const Eigen::Vector2d kSizePx(720.0, 480.0);

// Places all over the picture, and what a fit leaves of each: an error across the line from the
// epipole to where the point was found, that error included, as CorrectionOf has it.
struct Pair {
  std::vector<Eigen::Vector2d> places_px, corrections_px;

  Pair(size_t count, const Eigen::Vector2d& epipole_px, double noise_px,
       const Eigen::Vector2d& shift_px) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> u(0.0, kSizePx.x()), v(0.0, kSizePx.y());
    std::normal_distribution<double> noise(0.0, noise_px);
    for (size_t i = 0; i < count; ++i) {
      const double x = u(random), y = v(random);
      const Eigen::Vector2d point(x, y);
      Eigen::Vector2d across = (point - epipole_px).unitOrthogonal();
      const Eigen::Vector2d found = point + (noise(random) + across.dot(shift_px)) * across;
      across = (found - epipole_px).unitOrthogonal();
      places_px.push_back(found);
      corrections_px.push_back(across * across.dot(point - found));
    }
  }
  LeftOver Separated() const { return SeparateSmooth(places_px, corrections_px, kSizePx).value(); }
};

// Noise of each point's own is left as it is, also where the epipole is in the picture: a zoom
// about it would explain all of it.
TEST(SeparateSmooth, LeavesEachPointsOwnNoise) {
  for (const Eigen::Vector2d& epipole_px :
       {Eigen::Vector2d(300.0, 200.0), Eigen::Vector2d(1e6, 2e5)}) {
    double all = 0.0, unsmooth = 0.0;
    for (const size_t count : {60u, 80u, 100u, 120u, 140u, 160u}) {
      const LeftOver left = Pair(count, epipole_px, 0.4, {0.0, 0.0}).Separated();
      all += left.all / 6.0;
      unsmooth += left.unsmooth / 6.0;
    }
    EXPECT_NEAR(std::sqrt(all), 0.4, 0.05);
    EXPECT_NEAR(std::sqrt(unsmooth), std::sqrt(all), 0.1 * std::sqrt(all));
  }
}

TEST(SeparateSmooth, TakesOffAShiftOfThePicture) {
  for (const Eigen::Vector2d& epipole_px :
       {Eigen::Vector2d(300.0, 200.0), Eigen::Vector2d(1e6, 2e5)}) {
    const LeftOver left = Pair(150, epipole_px, 0.4, {1.5, -2.5}).Separated();
    EXPECT_GT(std::sqrt(left.all), 1.0);
    EXPECT_NEAR(std::sqrt(left.unsmooth), 0.4, 0.1);
  }
}

TEST(SeparateSmooth, SaysNothingOfAFewPoints) {
  const Pair few(5, {300.0, 200.0}, 0.4, {0.0, 0.0});
  EXPECT_FALSE(SeparateSmooth(few.places_px, few.corrections_px, kSizePx).has_value());
}

// A turn and what else is smooth leave the noise of both observations, whatever moves by itself.
TEST(UnsmoothVariance, IsThatOfBothObservations) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> u(0.0, kSizePx.x()), v(0.0, kSizePx.y());
  std::normal_distribution<double> noise(0.0, 0.5);
  std::vector<Match> matches;
  for (int i = 0; i < 400; ++i) {
    const double x = u(random), y = v(random);
    Match match;
    match.px_a = {x, y};
    match.px_b = {x + 8.0 + 2e-5 * x * y + noise(random),
                  y - 3.0 + 1e-7 * y * y * y + noise(random)};
    match.px_a += Eigen::Vector2d(noise(random), noise(random));
    if (i % 25 == 0) match.px_b.x() += 30.0;
    matches.push_back(match);
  }
  EXPECT_NEAR(UnsmoothVariance(matches, kSizePx), 4.0 * 0.25, 0.2);
  EXPECT_LT(UnsmoothVariance({matches.begin(), matches.begin() + 2}, kSizePx), 0.0);
}

}  // namespace
}  // namespace camgyro
