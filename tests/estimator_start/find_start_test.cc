#include "estimator/start/find_start.h"

#include <gmock/gmock.h>

#include "estimator/start/axis_permutation.h"
#include "simulated_rotation.h"

namespace camgyro {
namespace {

using ::testing::HasSubstr;

double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return Log(a.conjugate() * b).norm();
}

TEST(FindStart, ExactRotationsGiveExactStart) {
  SimulatedTruth truth;
  truth.delay_s = -0.0234;
  truth.q_gyro_cam = Exp(Eigen::Vector3d(0.4, -2.1, 0.9));
  truth.bias_gyro_rad_s = Eigen::Vector3d(0.02, -0.01, 0.03);
  truth.gyro_hz = 1000.0;  // interpolation error dt^2/12 * rate'' is below the tolerances
  const Simulated s = Simulate(SmoothRandomRate(1, 0.8), truth, 1);
  const auto start = FindStart(s.recording, s.rotations, {});
  ASSERT_TRUE(start) << start.error().message;
  EXPECT_NEAR(start->delay_middle_row_s, truth.delay_s, 2e-6);
  EXPECT_LT(AngleBetween(start->q_gyro_cam, truth.q_gyro_cam), 1e-5);
  EXPECT_LT((start->bias_gyro_rad_s - truth.bias_gyro_rad_s).norm(), 1e-5);
  EXPECT_NEAR(start->explained, 1.0, 1e-6);
  EXPECT_NEAR(start->rate_ratio, 1.0, 1e-4);
  EXPECT_EQ(start->rotation_axes_determined, 3);
}

TEST(FindStart, FindsEveryAxisPermutationWithDelaysOfSeconds) {
  const std::vector<Eigen::Matrix3d> permutations = AxisPermutations(1);
  ASSERT_EQ(permutations.size(), 24u);
  for (size_t k = 0; k < permutations.size(); ++k) {
    SCOPED_TRACE(k);
    SimulatedTruth truth;
    truth.delay_s = -1.9 + 3.8 * static_cast<double>(k) / 23.0;
    truth.q_gyro_cam = Eigen::Quaterniond(permutations[k]) * Exp(Eigen::Vector3d(0.03, 0, -0.02));
    truth.camera_noise_rad = 0.002;
    truth.gyro_noise_rad_s = 0.003;
    const Simulated s = Simulate(SmoothRandomRate(100 + static_cast<int>(k), 0.8), truth, 1);
    const auto start = FindStart(s.recording, s.rotations, {});
    ASSERT_TRUE(start) << start.error().message;
    EXPECT_NEAR(start->delay_middle_row_s, truth.delay_s, 5.0 * start->delay_sigma_s);
    EXPECT_LT(start->delay_sigma_s, 0.001);
    const double sigma_rad = start->rotation_sigma_rad.norm();
    EXPECT_LT(AngleBetween(start->q_gyro_cam, truth.q_gyro_cam), 3.5 * sigma_rad);
    EXPECT_LT(sigma_rad, 0.02);
    EXPECT_EQ(start->nearest_permutation, permutations[k]);
    EXPECT_NEAR(start->permutation_angle_rad, std::hypot(0.03, 0.02), 3.5 * sigma_rad);
  }
}

}  // namespace
}  // namespace camgyro
