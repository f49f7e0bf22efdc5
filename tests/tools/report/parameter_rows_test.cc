#include "tools/report/parameter_rows.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace camgyro {
namespace {

TEST(ParameterRows, PowersOfSecondsAreReadInMilliseconds) {
  EXPECT_EQ(ReadableUnitOf("s").name, "ms");
  EXPECT_EQ(ReadableUnitOf("s").scale * 0.016, 16.0);
  EXPECT_EQ(ReadableUnitOf("s^2").name, "ms^2");
  EXPECT_DOUBLE_EQ(ReadableUnitOf("s^2").scale * 0.016 * 0.016, 256.0);
  for (const char* unit : {"", "px", "rad/s^2", "px s/rad"}) {
    EXPECT_EQ(ReadableUnitOf(unit).name, unit);
    EXPECT_EQ(ReadableUnitOf(unit).scale, 1.0);
  }
}

TEST(ParameterRows, TwoDigitsOfTheSigmaAreShown) {
  EXPECT_EQ(DecimalsFor(123.0), 0);
  EXPECT_EQ(DecimalsFor(1.7), 1);
  EXPECT_EQ(DecimalsFor(0.039), 3);
  EXPECT_EQ(DecimalsFor(1e-12), 6);
}

// A shape is what a fit has found only where it has numbers that a fit tells better.
TEST(ParameterRows, AnEffectHasTheShapeThatWasFound) {
  EffectSet set;
  set.Add(FindEffect("optical_stabilisation"), "0.61/0.025",
          std::make_shared<Effect>(std::vector<EffectParameter>()));
  set.Add(FindEffect("radial_distortion"), "radtan",
          std::make_shared<Effect>(std::vector<EffectParameter>()));
  EXPECT_EQ(NameWithShape(set.items()[0]), "optical_stabilisation (0.61/0.025)");
  EXPECT_EQ(NameWithShape(set.items()[1]), "radial_distortion");
}

}  // namespace
}  // namespace camgyro
