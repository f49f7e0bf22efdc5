// The start on measured attitudes: ../shared/data/tablet-attitude, twelve hand-held minutes.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "core/so3.h"
#include "estimator/start/find_start.h"
#include "frontend/readers/read_recording.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

std::vector<CameraRotation> Rotations(const std::vector<Eigen::Quaterniond>& q_cam_world) {
  std::vector<CameraRotation> rotations;
  for (int a = 0; a + 1 < static_cast<int>(q_cam_world.size()); ++a) {
    rotations.push_back({a, a + 1, q_cam_world[a] * q_cam_world[a + 1].conjugate(), 0.0});
  }
  return rotations;
}

struct Expected {
  const char* name;
  double delay_ms;      // A + B of the recording's README, an independent fit
  double tolerance_ms;  // from the difference of B between halves there
};
// Tolerance: half the difference between the halves' B, plus 2 ms for another noise weighting.
const Expected kExpected[] = {
    {"D01", 47.8 + 15.8, 8.2},    {"D02", 982.6 + 10.4, 2.5},  {"D03", 10478.6 - 1.2, 3.1},
    {"D04", 41118.4 + 20.8, 2.6}, {"D05", 30.4 + 1.3, 5.9},    {"D06", 464917.1 + 34.3, 2.3},
    {"D07", 38168.8 + 47.8, 4.3}, {"D08", 2448.8 + 52.1, 3.9}, {"D10", 48.9 + 49.9, 4.4},
    {"D11", 25.1 - 0.5, 2.1},     {"D12", 18988.2 - 7.1, 2.3}, {"D13", 18630.9 - 13.1, 2.2},
};

class TabletAttitude : public ::testing::TestWithParam<Expected> {};

TEST_P(TabletAttitude, DelayAndOrientation) {
  const auto folder = MeasuredData(std::string("tablet-attitude/") + GetParam().name);
  if (!folder) GTEST_SKIP() << "no measured recordings: set CAMGYRO_DATA";
  const auto recording = ReadRecording(*folder);
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 1800u);
  const auto start = FindStart(*recording, Rotations(recording->q_cam_world), {});
  ASSERT_TRUE(start) << start.error().message;
  EXPECT_NEAR(1e3 * start->delay_middle_row_s, GetParam().delay_ms, GetParam().tolerance_ms);

  Eigen::Matrix3d R_cam_gyro;  // the Android axis map
  R_cam_gyro << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  const Eigen::Matrix3d map = R_cam_gyro.transpose();
  EXPECT_EQ(start->nearest_permutation, map);
  EXPECT_LT(start->permutation_angle_rad, 4.0 * M_PI / 180.0);
  EXPECT_EQ(start->rotation_axes_determined, 3);
  // Noisy poses (D06-D10, see the README) explain 84 % and more, the others 97 %.
  EXPECT_GT(start->explained, 0.8);
  EXPECT_LT(start->runner_up_ratio, 0.4);
  EXPECT_NEAR(start->rate_ratio, 1.0, 0.05);
}

INSTANTIATE_TEST_SUITE_P(All, TabletAttitude, ::testing::ValuesIn(kExpected),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace camgyro
