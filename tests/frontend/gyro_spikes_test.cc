#include "frontend/gyro_spikes.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <string>

#include "frontend/readers/read_recording.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

using ::testing::ElementsAre;

// 10 s of a turn to and fro at 200 Hz.
Recording Turning() {
  Recording recording;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.003);
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.005 * i;
    GyroSample sample;
    sample.stamp_ns = 1'000'000'000 + 5'000'000LL * i;
    sample.omega_gyro_rad_s << 1.5 * std::sin(4.0 * t) + noise(random),
        0.7 * std::cos(9.0 * t) + noise(random), noise(random);
    recording.gyro.push_back(sample);
  }
  return recording;
}

TEST(FindSpikes, AreSamplesThatJumpAndComeBack) {
  Recording recording = Turning();
  EXPECT_THAT(FindSpikes(recording.gyro), ElementsAre());
  recording.gyro[150].omega_gyro_rad_s.z() = 12.0;
  recording.gyro[700].omega_gyro_rad_s.setZero();  // while it turns by 1 rad/s
  recording.gyro[900].omega_gyro_rad_s.y() = -35.0;
  // A knock shakes on, a jolt stays, and what two samples have is a movement.
  for (int k = 0; k < 12; ++k) {
    recording.gyro[static_cast<size_t>(1200 + k)].omega_gyro_rad_s.x() +=
        3.0 * std::exp(-0.3 * k) * std::cos(1.2 * k);
    recording.gyro[static_cast<size_t>(1500 + k)].omega_gyro_rad_s.y() += 2.0;
  }
  for (size_t k = 1800; k < 1802; ++k) recording.gyro[k].omega_gyro_rad_s.z() += 1.0;
  EXPECT_THAT(FindSpikes(recording.gyro), ElementsAre(150, 700, 900));
}

// At the turning points of a shake its neighbours agree, too.
TEST(FindSpikes, AreNotTheTurningPointsOfAShortMovement) {
  Recording recording = Turning();
  for (size_t i = 0; i < recording.gyro.size(); ++i) {
    Eigen::Vector3d& omega = recording.gyro[i].omega_gyro_rad_s;
    omega.x() = omega.y() = omega.z();  // at rest, but for half of a second
    if (i >= 600 && i < 700)
      omega.x() += 5.0 * std::sin(2.0 * M_PI * 0.05 * static_cast<double>(i - 600));
  }
  EXPECT_THAT(FindSpikes(recording.gyro), ElementsAre());
  recording.gyro[1000].omega_gyro_rad_s.x() = 1.0;
  EXPECT_THAT(FindSpikes(recording.gyro), ElementsAre(1000));
}

TEST(MendSpikes, PutsTheLineBetweenTheNeighboursInTheirPlace) {
  const Recording right = Turning();
  Recording recording = right;
  for (const size_t i : {200U, 450U, 777U, 1000U, 1400U})
    recording.gyro[i].omega_gyro_rad_s.x() = -30.0;
  MendSpikes(&recording);
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].name, "gyro_spikes");
  EXPECT_EQ(recording.faults[0].count, 5);
  EXPECT_THAT(recording.faults[0].finding, ::testing::HasSubstr("5 of 2000"));
  EXPECT_THAT(recording.faults[0].finding, ::testing::HasSubstr("1.00 s after"));
  for (size_t i = 0; i < right.gyro.size(); ++i) {
    EXPECT_NEAR(recording.gyro[i].omega_gyro_rad_s.x(), right.gyro[i].omega_gyro_rad_s.x(), 0.02);
  }
}

TEST(MendSpikes, AKnockIsLeftAsItIs) {
  Recording recording = Turning();
  for (const size_t i : {400U, 420U, 450U, 480U, 510U})
    recording.gyro[i].omega_gyro_rad_s.y() = 9.0;
  ASSERT_EQ(FindSpikes(recording.gyro).size(), 5u);
  MendSpikes(&recording);
  EXPECT_TRUE(recording.faults.empty());
  EXPECT_EQ(recording.gyro[420].omega_gyro_rad_s.y(), 9.0);
}

// No measured recording has spikes in five of its seconds, also where somebody puts a tablet on a
// table.
TEST(MendSpikes, MeasuredRecordingsHaveNone) {
  int read = 0;
  for (const char* name : {"arkit-attitude/demo1", "euroc-v101-flight",
                           "euroc-v101-rest",      "gopro-hero5-karma/karma.mp4",
                           "iphone-cards",         "phone-cc9-street",
                           "phone-edge-hand",      "tablet-attitude/D01",
                           "tablet-attitude/D02",  "tablet-attitude/D03",
                           "tablet-attitude/D04",  "tablet-attitude/D05",
                           "tablet-attitude/D06",  "tablet-attitude/D07",
                           "tablet-attitude/D08",  "tablet-attitude/D10",
                           "tablet-attitude/D11",  "tablet-attitude/D12",
                           "tablet-attitude/D13",  "tango-walk/imu1",
                           "tango-walk/imu2",      "tango-walk/imu3",
                           "tango-walk/imu4",      "tango-walk/imu5"}) {
    const auto path = MeasuredData(name);
    if (!path) continue;
    const Result<Recording> recording = ReadRecording(*path);
    ASSERT_TRUE(recording) << recording.error().message;
    const size_t found = FindSpikes(recording->gyro).size();
    if (found > 0) std::printf("%s: %zu\n", name, found);
    for (const RecordedFault& fault : recording->faults) EXPECT_NE(fault.name, "gyro_spikes");
    ++read;
  }
  if (read == 0) GTEST_SKIP() << "*** SKIPPED: no measured recordings";
  EXPECT_GT(read, 15);
}

}  // namespace
}  // namespace camgyro
