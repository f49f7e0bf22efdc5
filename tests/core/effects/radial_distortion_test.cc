// What is plausible of a lens's distortion.
#include <gtest/gtest.h>

#include <cmath>

#include "core/effects/catalogue.h"

namespace camgyro {
namespace {

EffectParameter Term(double edge_rad, int column) {
  EffectSetup setup;
  setup.edge_rad = edge_rad;
  return MakeEffects("radial_distortion:kannala_brandt", setup)->parameter(column);
}

// Within 40 degrees off the axis theta^7 is small: a coefficient of -3 bends the edge by a third.
TEST(RadialDistortion, ATermIsPlausibleByWhatItMakesOfTheEdge) {
  const EffectParameter wide = Term(1.4, 2), unit = Term(1.0, 2), phone = Term(0.69, 2);
  EXPECT_EQ(wide.plausible_min, -2.0);
  EXPECT_EQ(unit.plausible_min, -2.0);
  EXPECT_NEAR(std::pow(0.69, 6) * phone.plausible_min, -2.0, 1e-12);
  EXPECT_LT(phone.plausible_min, -3.0);
  EXPECT_EQ(phone.spread, wide.spread);
  EXPECT_NEAR(std::pow(0.69, 2) * Term(0.69, 0).plausible_max, 0.5, 1e-12);
}

}  // namespace
}  // namespace camgyro
