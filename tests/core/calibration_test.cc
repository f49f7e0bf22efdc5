#include "core/calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "core/so3.h"

namespace camgyro {
namespace {

// Files and programs of others rely on these names, in this order.
TEST(StateTable, NamesTheParametersInTheOrderOfTheState) {
  const std::array<std::string, kStateSize> names = {"focal_px", "cx_px",  "cy_px",  "readout_s",
                                                     "delay_s",  "bias_x", "bias_y", "bias_z",
                                                     "q_x",      "q_y",    "q_z"};
  EXPECT_EQ(StateNames(), names);
  EXPECT_EQ(names[kStateReadout], "readout_s");
  EXPECT_EQ(names[kStateDelay], "delay_s");
  EXPECT_EQ(names[kStateBias], "bias_x");
  EXPECT_EQ(names[kStateRotation], "q_x");
}

TEST(StateTable, RowsAreToldApartAndTheirWidthsAreSizes) {
  const StateScales phone{1500.0, 1920.0, 2203.0, 1.0 / 30.0};
  std::set<std::string> names, labels, symbols;
  for (const StateParameter& p : StateTable()) {
    SCOPED_TRACE(p.name);
    EXPECT_TRUE(names.insert(p.long_name).second);
    EXPECT_TRUE(labels.insert(p.label).second);
    EXPECT_TRUE(symbols.insert(p.symbol).second);
    EXPECT_GT(p.unit_scale, 0.0);
    EXPECT_GT(p.error_scale, 0.0);
    EXPECT_GT(p.declared_sigma.In(phone), 0.0);
    // What is declared is known at least as well as what is not.
    EXPECT_LE(p.declared_sigma.In(phone), p.usual_sigma.In(phone));
    // Useful is what tells more than the prior.
    EXPECT_LE(p.useful_sigma.In(phone), p.declared_sigma.In(phone));
    // What needs pixels needs their fit.
    EXPECT_LE(p.needs_pixels, p.needs_fit);
  }
  EXPECT_DOUBLE_EQ(StateTable()[kStateFocal].declared_sigma.In(phone), 225.0);
  EXPECT_DOUBLE_EQ(StateTable()[kStateCx].usual_sigma.In(phone), 44.06);
  EXPECT_DOUBLE_EQ(StateTable()[kStateReadout].usual_sigma.In(phone), 0.02);
  EXPECT_DOUBLE_EQ(StateTable()[kStateDelay].usual_sigma.In(phone), 0.05);
}

TEST(Calibration, MovedUndoesDifference) {
  Calibration c;
  c.lens = MakePinhole(500.0, {320.0, 240.0});
  c.readout_s = 0.02;
  c.delay_s = -0.01;
  c.bias_gyro_rad_s << 0.01, -0.02, 0.03;
  c.q_gyro_cam = Exp(Eigen::Vector3d(0.4, -1.0, 0.3));
  StateVector d;
  d << 7.0, -3.0, 2.0, 1e-3, -2e-3, 0.01, 0.02, -0.03, 0.1, -0.2, 0.3;
  const Calibration moved = Moved(c, d);
  EXPECT_LT((Difference(moved, c) - d).norm(), 1e-12);
  EXPECT_EQ(moved.readout_s, 0.021);
  // The mounting as numbers is counted from the reference, about the camera's axes.
  const StateVector values = ValuesOf(moved, c.q_gyro_cam);
  EXPECT_EQ(values[kStateFocal], 507.0);
  EXPECT_EQ(values[kStateBias + 1], 0.0);
  EXPECT_LT((values.tail<3>() - d.tail<3>()).norm(), 1e-12);
}

}  // namespace
}  // namespace camgyro
