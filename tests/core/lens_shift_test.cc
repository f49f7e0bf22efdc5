#include "core/lens_shift.h"

#include <gtest/gtest.h>

namespace camgyro {
namespace {

TEST(LensShift, IsStraightBetweenSamplesAndStaysAtTheEnds) {
  // 10 ms apart, a second after the origin.
  const LensShift shift({{2000000000, {1.0, -4.0}}, {2010000000, {3.0, 0.0}}}, 1000000000);
  EXPECT_LT((shift.At(1.0025) - Eigen::Vector2d(1.5, -3.0)).norm(), 1e-6);
  EXPECT_EQ(shift.At(0.5), Eigen::Vector2d(1.0, -4.0));
  EXPECT_EQ(shift.At(1.5), Eigen::Vector2d(3.0, 0.0));
  EXPECT_LT((shift.RateAt(1.005) - Eigen::Vector2d(200.0, 400.0)).norm(), 1e-4);
  EXPECT_EQ(shift.RateAt(0.5), Eigen::Vector2d(0.0, 0.0));
}

}  // namespace
}  // namespace camgyro
