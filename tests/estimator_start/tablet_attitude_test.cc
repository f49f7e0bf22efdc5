// The start on measured attitudes: ../shared/data/tablet-attitude, twelve hand-held minutes.
#include <gmock/gmock.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "../measured_data.h"
#include "core/so3.h"
#include "estimator/start/find_start.h"

namespace camgyro {
namespace {

struct Row {
  int64_t stamp_ns;
  std::vector<double> values;
};

// These files are known to be sound: "stamp,x,y,...", one header line. The readers have their own
// tests; this one depends on core only.
std::vector<Row> ReadRows(const std::string& path) {
  std::vector<Row> rows;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    Row row;
    std::string cell;
    std::getline(cells, cell, ',');
    row.stamp_ns = std::stoll(cell);
    while (std::getline(cells, cell, ',')) row.values.push_back(std::stod(cell));
    rows.push_back(row);
  }
  return rows;
}

Recording ReadAttitudeRecording(const std::string& folder) {
  Recording recording;
  for (const Row& row : ReadRows(folder + "/cam0/attitude.csv")) {
    Frame frame;
    frame.stamp_ns = row.stamp_ns;
    recording.frames.push_back(frame);
    recording.q_cam_world.push_back(
        Eigen::Quaterniond(row.values[0], row.values[1], row.values[2], row.values[3])
            .normalized());
  }
  for (const Row& row : ReadRows(folder + "/imu0/data.csv")) {
    if (!recording.gyro.empty() && row.stamp_ns <= recording.gyro.back().stamp_ns) continue;
    recording.gyro.push_back({row.stamp_ns, {row.values[0], row.values[1], row.values[2]}});
  }
  return recording;
}

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
  const Recording recording = ReadAttitudeRecording(*folder);
  ASSERT_EQ(recording.frames.size(), 1800u);
  const auto begin = std::chrono::steady_clock::now();
  const auto start = FindStart(recording, Rotations(recording.q_cam_world), {});
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  ASSERT_TRUE(start) << start.error().message;
  EXPECT_NEAR(1e3 * start->delay_middle_row_s, GetParam().delay_ms, GetParam().tolerance_ms);

  Eigen::Matrix3d R_cam_gyro;  // the Android axis map
  R_cam_gyro << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  const Eigen::Matrix3d map = R_cam_gyro.transpose();
  EXPECT_EQ(start->nearest_permutation, map);
  EXPECT_LT(start->permutation_angle_rad, 4.0 * M_PI / 180.0);
  EXPECT_EQ(start->rotation_axes_determined, 3);
  std::printf(
      "%s delay %10.2f ms +- %.2f (README %+.2f) axis map %.2f deg (sigma %.2f %.2f %.2f) bias "
      "%.4f %.4f %.4f +- %.4f %.4f %.4f explained %.3f runner-up %.2f ratio %.3f inliers %.2f "
      "noise %.3f time %.2f s\n",
      GetParam().name, 1e3 * start->delay_middle_row_s, 1e3 * start->delay_sigma_s,
      1e3 * start->delay_middle_row_s - GetParam().delay_ms,
      start->permutation_angle_rad * 180.0 / M_PI, start->rotation_sigma_rad[0] * 180.0 / M_PI,
      start->rotation_sigma_rad[1] * 180.0 / M_PI, start->rotation_sigma_rad[2] * 180.0 / M_PI,
      start->bias_gyro_rad_s[0], start->bias_gyro_rad_s[1], start->bias_gyro_rad_s[2],
      start->bias_sigma_rad_s[0], start->bias_sigma_rad_s[1], start->bias_sigma_rad_s[2],
      start->explained, start->runner_up_ratio, start->rate_ratio, start->inliers,
      start->noise_rad_s, took.count());
  for (const auto& note : start->notes) std::printf("  %s\n", note.c_str());
}

INSTANTIATE_TEST_SUITE_P(All, TabletAttitude, ::testing::ValuesIn(kExpected),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace camgyro
