#include "core/gyro_gap.h"

#include <gtest/gtest.h>

namespace camgyro {
namespace {

TEST(LongestGyroStep, IsFiveIntervalsOfASlowGyroAndALumpOfAFastOne) {
  EXPECT_DOUBLE_EQ(LongestGyroStep(0.01), 0.05);
  EXPECT_DOUBLE_EQ(LongestGyroStep(0.02), 0.1);
  EXPECT_DOUBLE_EQ(LongestGyroStep(0.0025), 0.03);
  EXPECT_DOUBLE_EQ(LongestGyroStep(0.0), 0.03);
}

}  // namespace
}  // namespace camgyro
