#include "frontend/quantile_line.h"

#include <gmock/gmock.h>

#include <random>

namespace camgyro {
namespace {

// Latencies above a line: the line goes where the fraction below it is the one that was asked for,
// with the slope of what they lie above.
TEST(QuantileLine, HasTheFractionBelowIt) {
  std::mt19937 random(1);
  std::exponential_distribution<double> late(1.0);
  std::vector<LinePoint> points;
  for (int i = 0; i < 200; ++i) points.push_back({0.5 * i, 3.0 * (0.5 * i) + late(random)});
  for (const double q : {0.1, 0.2, 0.5}) {
    const StraightLine line = QuantileLine(points, q);
    // The quantile of an exponential is known to 0.07 there, over 29 (rms) of x.
    EXPECT_NEAR(line.slope, 3.0, 0.01) << q;
    int below = 0;
    for (const LinePoint& p : points) below += p.y < line.At(p.x) - 1e-9 ? 1 : 0;
    EXPECT_NEAR(below, 200 * q, 2.0) << q;  // two of the points are on it
  }
}

TEST(QuantileLine, OfOnePointIsLevel) {
  const StraightLine line = QuantileLine({{2.0, 5.0}}, 0.2);
  EXPECT_EQ(line.At(-10.0), 5.0);
}

}  // namespace
}  // namespace camgyro
