#include "tools/recording_input.h"

#include <gmock/gmock.h>

#include "frontend/readers/repair_stamps.h"

namespace camgyro {
namespace {

// Stamps that are rounded to 5 ms are 35, 30 and 35 ms apart, of a camera that takes 30 frames/s.
TEST(DescribeRecording, RatesAreThoseOfTheClocksBehindTheStamps) {
  Recording recording;
  constexpr int64_t kStepNs = 5'000'000, kSecondNs = 1'000'000'000;
  for (int64_t i = 0; i <= 300; ++i) {
    const int64_t stamp_ns = kSecondNs + i * kSecondNs / 30;
    recording.frames.emplace_back();
    recording.frames.back().stamp_ns = (stamp_ns + kStepNs / 2) / kStepNs * kStepNs;
  }
  for (int64_t i = 0; i <= 2000; ++i) {
    recording.gyro.push_back({kSecondNs + i * kStepNs, Eigen::Vector3d::Zero()});
  }
  EXPECT_EQ(DescribeRecording(recording), "301 frames in 10.0 s (28.6 Hz), gyro 200 Hz");
  RepairStamps(StampsMode::kAuto, &recording);
  EXPECT_EQ(DescribeRecording(recording), "301 frames in 10.0 s (30.0 Hz), gyro 200 Hz");
}

}  // namespace
}  // namespace camgyro
