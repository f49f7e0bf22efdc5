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

// Of the picture by the effect, at 5 s, per unit of each of its parameters (columns).
Eigen::Matrix2Xd ShiftsOf(const std::string& shape, const EffectSetup& setup) {
  const EffectSet set = MakeEffects("optical_stabilisation:" + shape, setup).value();
  Eigen::Matrix<double, kLensSize, Eigen::Dynamic> columns =
      Eigen::Matrix<double, kLensSize, Eigen::Dynamic>::Zero(kLensSize, set.size());
  const Observation middle = {Eigen::Vector2d(320.0, 240.0), setup.size_px, setup.frames[100]};
  set.items().front().effect->ChangeLens(middle, columns);
  return columns.middleRows<2>(kCx);
}

Eigen::Vector2d ShiftOf(const std::string& shape, const EffectSetup& setup) {
  return ShiftsOf(shape, setup).col(0);
}

TEST(OpticalStabilisation, TheLensGoesNoFurtherThanItsStop) {
  // A high-pass of 0.5 Hz leaves 2 / sqrt(5) of a tone of 1 Hz.
  const double free = 2.0 / std::sqrt(5.0) * 0.06;
  EXPECT_NEAR(ShiftOf("0.5", Circling(0.06)).norm(), free, 0.02 * free);
  EXPECT_NEAR(ShiftOf("0.5/0.025", Circling(0.06)).norm(), 0.025, 1e-4);
  EXPECT_NEAR(ShiftOf("0.5/0.07", Circling(0.06)).norm(), free, 0.02 * free);
}

enum { kShift, kCorner, kLag, kCross, kDifference, kStop, kCentreX, kCentreY, kWithStop };

// A lens of another corner or stop than the shape's is the shape with changes, to first order.
TEST(OpticalStabilisation, ChangesOfCornerAndStopAreParameters) {
  constexpr double kLog = 0.03, kBound = kLog * kLog;
  const EffectSetup setup = Circling(0.06);
  const auto is_near = [&](const std::string& other, const std::string& shape, int parameter) {
    const Eigen::Matrix2Xd shifts = ShiftsOf(shape, setup);
    const Eigen::Vector2d moved = shifts.col(kShift) + kLog * shifts.col(parameter);
    const Eigen::Vector2d is = ShiftOf(other, setup);
    EXPECT_GT((is - shifts.col(kShift)).norm(), 3.0 * kBound * is.norm());
    EXPECT_LT((is - moved).norm(), kBound * is.norm());
  };
  ASSERT_EQ(ShiftsOf("0.5", setup).cols(), kStop);
  ASSERT_EQ(ShiftsOf("0.5/0.025", setup).cols(), kWithStop);
  is_near(std::to_string(0.5 * std::exp(kLog)), "0.5", kCorner);
  is_near("0.5/" + std::to_string(0.025 * std::exp(kLog)), "0.5/0.025", kStop);
}

// A lens that is late is where it was before, one with other axes is turned, and one whose stops
// are off the centre ends where they are.
TEST(OpticalStabilisation, LagAxesAndCentreAreParameters) {
  const EffectSetup setup = Circling(0.06);
  EffectSetup later = setup;
  constexpr double kLate_s = 0.005;
  for (FrameTime& frame : later.frames) frame.stamp_s += kLate_s;
  for (const std::string shape : {"0.5", "0.5/0.025"}) {
    const Eigen::Matrix2Xd shifts = ShiftsOf(shape, setup);
    const Eigen::Vector2d shift = shifts.col(kShift);
    const Eigen::Vector2d before =
        ShiftOf(shape, later) + kLate_s * ShiftsOf(shape, later).col(kLag);
    EXPECT_LT((before - shift).norm(), 0.001 * shift.norm()) << shape;
    EXPECT_LT((shifts.col(kCross) - Eigen::Vector2d(-shift.y(), shift.x())).norm(), 1e-9);
    EXPECT_LT((shifts.col(kDifference) - Eigen::Vector2d(-shift.x(), shift.y())).norm(), 1e-9);
  }
  // 5 s about x against its stop, and back: there, the lens is as far from the centre as it goes.
  auto there_and_back = std::make_shared<SensorSamples>(*setup.gyro);
  for (Eigen::Index i = 0; i < there_and_back->values.cols(); ++i) {
    there_and_back->values.col(i) << (i < 1001 ? 0.3 : -0.3), 0.0, 0.0;
  }
  EffectSetup at_stop = setup;
  at_stop.gyro = there_and_back;
  const Eigen::Matrix2Xd shifts = ShiftsOf("0.5/0.025", at_stop);
  EXPECT_LT((shifts.col(kShift) - Eigen::Vector2d(0.0, -0.025)).norm(), 1e-9);
  EXPECT_LT((shifts.col(kCentreX) - Eigen::Vector2d(0.0, -1.0)).norm(), 1e-6);
  // It slides along the stop to where it is pressed against it: by the turn, less what it forgets.
  const double pressed = 1.0 - 2.0 * M_PI * 0.5 * 0.025 / 0.3;
  EXPECT_LT((shifts.col(kCentreY) - Eigen::Vector2d(pressed, 0.0)).norm(), 1e-3);
}

TEST(OpticalStabilisation, AFitSaysTheShape) {
  const EffectEntry& entry = *FindEffect("optical_stabilisation");
  std::vector<double> values = {500.0, 100.0, 1.0, 2.0, 3.0, -50.0, 4.0, 5.0};
  // times exp(0.2), exp(-0.1)
  EXPECT_EQ(entry.shape_by_fit("0.5/0.025", values.data()), "0.611/0.0226");
  EXPECT_THAT(values, ElementsAre(500.0, 0.0, 1.0, 2.0, 3.0, 0.0, 4.0, 5.0));
  values = {500.0, 1000.0, 1.0, 2.0, 3.0};
  EXPECT_EQ(entry.shape_by_fit("0.5", values.data()), "0.824");  // times exp(0.5) at most
  values = {0.1, 100.0, 1.0, 2.0, 3.0};
  EXPECT_EQ(entry.shape_by_fit("0.5", values.data()), "0.5");
  EXPECT_THAT(values, ElementsAre(0.1, 100.0, 1.0, 2.0, 3.0));
}

TEST(OpticalStabilisation, AStopIsOfferedWhereTheMotionReachesIt) {
  const EffectEntry& entry = *FindEffect("optical_stabilisation");
  EXPECT_THAT(entry.shapes(EffectSetup()), ElementsAre("0.5"));  // no gyro at all
  EXPECT_THAT(entry.shapes(Circling(0.02)), ElementsAre("0.5"));
  EXPECT_THAT(entry.shapes(Circling(0.06)), ElementsAre("0.5", "0.5/0.025"));
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
  Eigen::VectorXd start = Eigen::VectorXd::Zero(kWithStop);
  entry.make(setup, "0.62/0.031")->SetStart(start.data());
  EXPECT_EQ(start, 432.0 * Eigen::VectorXd::Unit(kWithStop, kShift));
}

// A lens that was logged is there, whatever the gyro says.
TEST(OpticalStabilisation, TakesTheLensFromItsLog) {
  EffectSetup setup = Circling(0.06);
  const EffectEntry& entry = *FindEffect("optical_stabilisation");
  EXPECT_FALSE(entry.found_at_start(setup));
  EXPECT_FALSE(MakeEffects("optical_stabilisation:logged", setup));
  std::vector<LensSample> samples;  // 30 px/s to the right and 12 px/s up, zero at 4 s
  for (int i = 0; i <= 100; ++i) {
    samples.push_back({100'000'000LL * i, Eigen::Vector2d(30.0, -12.0) * (0.1 * i - 4.0)});
  }
  setup.lens_shift = std::make_shared<LensShift>(samples, 0);
  setup.lens_is_held = true;  // of the start, which took the log's shift out
  setup.readout_s = 0.02;     // the pixel is in the middle row
  EXPECT_TRUE(entry.found_at_start(setup));
  EXPECT_THAT(entry.shapes(setup), ElementsAre("logged"));
  const auto expect_at = [&](const std::string& shape, double time_s) {
    const Eigen::Vector2d is = Eigen::Vector2d(30.0, -12.0) * (time_s - 4.0);
    Eigen::Matrix<double, 2, 4> expected;
    expected << is, Eigen::Vector2d(30.0, -12.0), Eigen::Vector2d(-is.y(), is.x()),
        Eigen::Vector2d(is.x(), -is.y());
    EXPECT_LT((ShiftsOf(shape, setup) - expected).norm(), 1e-6) << shape;
  };
  expect_at("logged", 5.01);
  expect_at("logged/0.003", 5.013);
  Eigen::VectorXd start = Eigen::VectorXd::Zero(4);
  const std::shared_ptr<const Effect> effect = entry.make(setup, "logged");
  effect->SetStart(start.data());
  EXPECT_EQ(start, Eigen::VectorXd::Unit(4, 0));
  EXPECT_FALSE(effect->hides_turns());
  EXPECT_TRUE(entry.make(setup, "0.5")->hides_turns());
}

TEST(OpticalStabilisation, AFitSaysHowLateTheLogIs) {
  const EffectEntry& entry = *FindEffect("optical_stabilisation");
  std::vector<double> values = {0.5, 0.001, 0.1, 0.2};  // half of it, by 1 ms px
  EXPECT_EQ(entry.shape_by_fit("logged", values.data()), "logged/0.002");
  EXPECT_THAT(values, ElementsAre(0.5, 0.0, 0.1, 0.2));
  values[1] = -0.001;
  EXPECT_EQ(entry.shape_by_fit("logged/0.002", values.data()), "logged");
  values = {0.01, 0.001, 0.0, 0.0};  // a lens that is not there has no time
  EXPECT_EQ(entry.shape_by_fit("logged", values.data()), "logged");
}

TEST(OpticalStabilisation, RefusesWhatIsNoShape) {
  for (const std::string shape : {"x", "0", "-1", "0.5/", "0.5/0", "0.5/0.02x", "0.5x", "logged",
                                  "logged/", "logged/x", "logged/1"}) {
    EXPECT_FALSE(MakeEffects("optical_stabilisation:" + shape, Circling(0.06))) << shape;
  }
}

}  // namespace
}  // namespace camgyro
