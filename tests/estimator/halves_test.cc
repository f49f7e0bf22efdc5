// How halves of a recording disagree.
#include "estimator/halves.h"

#include <gtest/gtest.h>

namespace camgyro {
namespace {

Calibration AtFocal(double focal_px, double sigma_px) {
  Calibration c;
  c.width_px = 640;
  c.height_px = 480;
  c.lens = MakePinhole(focal_px, {319.5, 239.5});
  c.covariance = 1e-4 * StateCovariance::Identity();
  c.covariance(kStateFocal, kStateFocal) = sigma_px * sigma_px;
  return c;
}

TEST(HalvesChi2, IsOfTheirDifference) {
  const Calibration whole = AtFocal(500.0, 1.4);
  EXPECT_NEAR(HalvesChi2(AtFocal(500.0, 2.0), AtFocal(500.0, 2.0), whole), 0.0, 1e-12);
  EXPECT_NEAR(HalvesChi2(AtFocal(495.0, 3.0), AtFocal(505.0, 4.0), whole), 4.0 / kStateSize, 1e-9);
}

// Ten sigmas of that half, of which the whole shares one half: 200 in all.
TEST(HalvesChi2, LeavesOutAHalfThatHasRunAway) {
  const Calibration whole = AtFocal(500.0, 1.4), away = AtFocal(10.0, 4.0);
  EXPECT_NEAR(HalvesChi2(away, AtFocal(520.0, 2.0), whole), 200.0 / kStateSize, 1e-9);
  EXPECT_NEAR(HalvesChi2(AtFocal(520.0, 2.0), away, whole), 200.0 / kStateSize, 1e-9);
}

// So that a whole whose halves lead nowhere is not taken for right.
TEST(HalvesChi2, OfTwoThatHaveRunAwayIsLarge) {
  const Calibration whole = AtFocal(500.0, 1.4);
  EXPECT_GT(HalvesChi2(AtFocal(10.0, 4.0), AtFocal(4000.0, 3.0), whole), kHalvesLimit);
}

}  // namespace
}  // namespace camgyro
