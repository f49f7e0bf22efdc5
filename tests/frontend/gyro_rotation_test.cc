#include "frontend/gyro_rotation.h"

#include <gmock/gmock.h>

#include <cmath>

namespace camgyro {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

// A gyro that turns about one axis at a constant rate, sampled at 200 Hz for 1 s, with a bias.
std::vector<GyroSample> ConstantRate(const Eigen::Vector3d& omega_gyro_rad_s) {
  std::vector<GyroSample> gyro;
  for (int i = 0; i <= 200; ++i) gyro.push_back({5 * kSecond + i * 5'000'000, omega_gyro_rad_s});
  return gyro;
}

// Gyro axes as an Android phone's: gyro (x, y, z) = camera (-y, -x, -z).
Calibration Phone() {
  Calibration c;
  c.width_px = 640;
  c.height_px = 480;
  c.lens = MakePinhole(500.0, {320.0, 240.0});
  c.readout_s = 0.024;
  c.delay_s = 0.1;
  c.bias_gyro_rad_s << 0.01, -0.02, 0.03;
  Eigen::Matrix3d R;
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  c.q_gyro_cam = Eigen::Quaterniond(R);
  return c;
}

// The camera pans to the right (about its y axis, which points down) at 0.9 rad/s. A point at
// infinity moves to the left by f tan of the angle, which goes over the interval and, for a point
// that keeps its row, no longer.
TEST(GyroRotationTest, PanMovesPointsByTheAngle) {
  const Calibration c = Phone();
  const Eigen::Vector3d omega = c.q_gyro_cam * Eigen::Vector3d(0, 0.9, 0) + c.bias_gyro_rad_s;
  const auto rotation =
      GyroRotation::Between(ConstantRate(omega), c, 5 * kSecond, 5 * kSecond + 40'000'000);
  ASSERT_TRUE(rotation);
  const Eigen::Vector2d px = rotation->Predict({320.0, 240.0});
  EXPECT_NEAR(px.x(), 320.0 - 500.0 * std::tan(0.9 * 0.04), 1e-6);
  EXPECT_NEAR(px.y(), 240.0, 1e-6);
}

// Tilting up (about x) moves points down; each row further down is exposed t_r / h later, so the
// angle solves  a = w (T + t_r (v' - v) / h),  v' - v = f tan a  from the centre.
TEST(GyroRotationTest, RowOfArrivalDecidesItsOwnTime) {
  const Calibration c = Phone();
  const Eigen::Vector3d omega = c.q_gyro_cam * Eigen::Vector3d(0.9, 0, 0) + c.bias_gyro_rad_s;
  const auto rotation =
      GyroRotation::Between(ConstantRate(omega), c, 5 * kSecond, 5 * kSecond + 40'000'000);
  ASSERT_TRUE(rotation);
  double shift = 0.0;
  for (int i = 0; i < 50; ++i) shift = 500.0 * std::tan(0.9 * (0.04 + 0.024 * shift / 480.0));
  EXPECT_NEAR(rotation->Predict({320.0, 240.0}).y(), 240.0 + shift, 2e-3);
}

TEST(GyroRotationTest, RaysOfAPurelyRotatingCameraAgree) {
  const Calibration c = Phone();
  const Eigen::Vector3d omega = c.q_gyro_cam * Eigen::Vector3d(0.5, -0.7, 1.1) + c.bias_gyro_rad_s;
  const auto rotation =
      GyroRotation::Between(ConstantRate(omega), c, 5 * kSecond, 5 * kSecond + 40'000'000);
  ASSERT_TRUE(rotation);
  const Eigen::Vector2d px(100.0, 400.0);
  const auto match = rotation->Rotate({px, rotation->Predict(px)});
  ASSERT_TRUE(match);
  EXPECT_LT(match->a.normalized().cross(match->b.normalized()).norm(), 1e-6);
}

TEST(GyroRotationTest, NeedsTheGyroOverBothFrames) {
  const Calibration c = Phone();
  auto gyro = ConstantRate(Eigen::Vector3d::Zero());
  const int64_t interval = 40'000'000;
  EXPECT_TRUE(GyroRotation::Between(gyro, c, 5 * kSecond, 5 * kSecond + interval));
  EXPECT_FALSE(GyroRotation::Between(gyro, c, 4 * kSecond, 4 * kSecond + interval));
  EXPECT_FALSE(GyroRotation::Between(gyro, c, 6 * kSecond, 6 * kSecond + interval));
  EXPECT_FALSE(GyroRotation::Between({}, c, 5 * kSecond, 5 * kSecond + interval));
  gyro.erase(gyro.begin() + 22, gyro.begin() + 28);  // 35 ms without samples: core/gyro_gap.h
  EXPECT_FALSE(GyroRotation::Between(gyro, c, 5 * kSecond, 5 * kSecond + interval));
}

}  // namespace
}  // namespace camgyro
