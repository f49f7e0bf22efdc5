#include "core/saturation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace camgyro {
namespace {

// 10 s at 200 Hz, turning to and fro with peaks of 0.7 to 1.3 rad/s, no two alike, written down in
// steps (0: as they are), and cut off at a rail.
std::vector<GyroSample> TurningToAndFro(double step_rad_s, double rail_rad_s) {
  std::vector<GyroSample> gyro;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.005 * i;
    const Eigen::Vector3d rate =
        Eigen::Vector3d(std::sin(7.0 * t) + 0.3 * std::sin(2.7 * t),
                        0.7 * std::cos(5.0 * t) + 0.3 * std::sin(1.9 * t), 1.3 * std::cos(3.3 * t));
    GyroSample sample;
    sample.stamp_ns = 5000000LL * i;
    for (int k = 0; k < 3; ++k) {
      double value = std::clamp(rate[k], -rail_rad_s, rail_rad_s);
      if (step_rad_s > 0.0) value = step_rad_s * std::round(value / step_rad_s);
      sample.omega_gyro_rad_s[k] = value;
    }
    gyro.push_back(sample);
  }
  return gyro;
}

auto CountSaturated(const std::vector<GyroSample>& gyro) {
  const std::vector<bool> saturated = FindSaturated(gyro);
  return std::count(saturated.begin(), saturated.end(), true);
}

TEST(FindSaturated, FindsTheRailAlsoInCoarseSteps) {
  for (const double step : {0.0, 0.001, 0.01, 0.02}) {
    const std::vector<GyroSample> gyro = TurningToAndFro(step, 0.9);
    const double rail = step > 0.0 ? step * std::round(0.9 / step) : 0.9;
    const auto at_rail = std::count_if(gyro.begin(), gyro.end(), [&](const GyroSample& s) {
      return s.omega_gyro_rad_s.cwiseAbs().maxCoeff() > rail - 1e-9;
    });
    EXPECT_GT(at_rail, 200);
    EXPECT_EQ(CountSaturated(gyro), at_rail) << step;
  }
}

// A peak in coarse steps is flat, and no rail.
TEST(FindSaturated, NothingInCoarseSteps) {
  for (const double step : {0.0, 0.001, 0.01, 0.017, 0.02, 0.05, 0.1, 0.2}) {
    EXPECT_EQ(CountSaturated(TurningToAndFro(step, 100.0)), 0) << step;
  }
}

}  // namespace
}  // namespace camgyro
