// Stabilised lenses, with and without a stop.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/effects/catalogue.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;

// 10 s about the camera's x and y axes at 1 Hz, a quarter of a period apart, with this amplitude: a
// circle of the angle, of this radius.
EffectSetup Circling(double angle_rad) {
  EffectSetup setup;
  auto gyro = std::make_shared<SensorSamples>();
  gyro->values.resize(3, 2001);
  for (int i = 0; i <= 2000; ++i) {
    const double t = 0.005 * i, rate = 2.0 * M_PI * angle_rad;
    gyro->times_s.push_back(t);
    gyro->values.col(i) << rate * std::cos(2.0 * M_PI * t), rate * std::sin(2.0 * M_PI * t), 0.0;
  }
  setup.gyro = gyro;
  for (int i = 0; i < 200; ++i) setup.frames.push_back({0.05 * i, 0.0});
  setup.size_px << 640.0, 480.0;
  return setup;
}

// Of the picture by the effect, at 5 s, per unit of its parameter.
Eigen::Vector2d ShiftOf(const std::string& shape, const EffectSetup& setup) {
  const EffectSet set = MakeEffects("optical_stabilisation:" + shape, setup).value();
  Eigen::Matrix<double, kLensSize, Eigen::Dynamic> columns =
      Eigen::Matrix<double, kLensSize, Eigen::Dynamic>::Zero(kLensSize, 1);
  const Observation middle = {Eigen::Vector2d(320.0, 240.0), setup.size_px, setup.frames[100]};
  set.items().front().effect->ChangeLens(middle, columns);
  return {columns(kCx, 0), columns(kCy, 0)};
}

TEST(OpticalStabilisation, TheLensGoesNoFurtherThanItsStop) {
  // A high-pass of 0.5 Hz leaves 2 / sqrt(5) of a tone of 1 Hz.
  const double free = 2.0 / std::sqrt(5.0) * 0.06;
  EXPECT_NEAR(ShiftOf("0.5", Circling(0.06)).norm(), free, 0.02 * free);
  EXPECT_NEAR(ShiftOf("0.5/0.025", Circling(0.06)).norm(), 0.025, 1e-4);
  EXPECT_NEAR(ShiftOf("0.5/0.07", Circling(0.06)).norm(), free, 0.02 * free);
}

TEST(OpticalStabilisation, StopsAreOfferedWhereTheMotionReachesThem) {
  const EffectEntry& entry = *FindEffect("optical_stabilisation");
  EXPECT_THAT(entry.shapes(EffectSetup()), ElementsAre("0.15", "1", "0.5"));  // no gyro at all
  EXPECT_THAT(entry.shapes(Circling(0.01)), ElementsAre("0.15", "1", "0.5"));
  EXPECT_THAT(entry.shapes(Circling(0.02)), ElementsAre("0.15", "1", "0.5", "0.5/0.015"));
  EXPECT_EQ(entry.shapes(Circling(0.06)).back(), "0.5/0.025");
  EXPECT_THAT(entry.shapes(Circling(0.06)), Contains("0.5/0.04"));
  EffectSetup attitudes = Circling(0.06);
  attitudes.has_pixels = false;
  EXPECT_TRUE(entry.shapes(attitudes).empty());
}

TEST(OpticalStabilisation, HasTheShapeThatTheStartHasFound) {
  const EffectEntry& entry = *FindEffect("optical_stabilisation");
  EffectSetup setup = Circling(0.06);
  setup.lens_is_held = true;
  EXPECT_TRUE(entry.shapes(setup).empty());
  EXPECT_TRUE(MakeEffects("optical_stabilisation:0.5", setup));  // what is asked for is made
  setup.lens_is_held = false;
  setup.stabiliser = OpticalStabiliser{0.62, 0.031};
  setup.stabiliser_px_per_rad = 432.0;
  EXPECT_THAT(entry.shapes(setup), ElementsAre("0.62/0.031"));
  double start = 0.0;
  entry.make(setup, "0.62/0.031")->SetStart(&start);
  EXPECT_EQ(start, 432.0);
}

TEST(OpticalStabilisation, RefusesWhatIsNoShape) {
  for (const std::string shape : {"x", "0", "-1", "0.5/", "0.5/0", "0.5/0.02x", "0.5x"}) {
    EXPECT_FALSE(MakeEffects("optical_stabilisation:" + shape, Circling(0.06))) << shape;
  }
}

}  // namespace
}  // namespace camgyro
