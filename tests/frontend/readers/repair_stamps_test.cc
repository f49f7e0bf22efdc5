#include "frontend/readers/repair_stamps.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <utility>

#include "core/time.h"
#include "frontend/readers/read_recording.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

using testing::Contains;
using testing::HasSubstr;

// 20 s of a moving gyro of 200 Hz, its stamps late by 1 ms in the mean, and frames of a clean
// clock.
Recording LateRecording(double latency_s) {
  std::mt19937 random(4);
  std::exponential_distribution<double> latency(1.0);
  Recording recording;
  double last_s = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double t = 5e-3 * i;
    last_s = std::max(last_s + 1e-6, t + latency_s * latency(random));
    recording.gyro.push_back({StampAt(0, last_s), {std::sin(9.0 * t), std::cos(7.0 * t), 0.1}});
    recording.accel.push_back({StampAt(0, last_s), {0.0, 0.0, 9.8}});
  }
  for (int i = 0; i < 600; ++i) recording.frames.emplace_back().stamp_ns = 33'333'333L * i;
  return recording;
}

TEST(RepairStamps, ReplacesArrivalTimesUnlessToldNotTo) {
  const Recording late = LateRecording(1e-3);
  Recording recording = late;
  RepairStamps(StampsMode::kAuto, &recording);
  EXPECT_TRUE(recording.gyro_stamps->repaired);
  EXPECT_EQ(recording.gyro_stamps->kind, StampKind::kArrival);
  EXPECT_NEAR(recording.gyro_stamps->period_s, 5e-3, 1e-7);
  EXPECT_EQ(recording.camera_stamps->kind, StampKind::kMeasured);
  EXPECT_THAT(recording.notes, Contains(HasSubstr("laid on a clock of 5")));
  for (size_t i = 0; i < recording.gyro.size(); ++i) {
    const double error_s =
        SecondsSince(0, recording.gyro[i].stamp_ns) - 5e-3 * static_cast<double>(i);
    ASSERT_NEAR(error_s, std::log(2.0) * 1e-3, 0.1e-3);  // the median of the latency
    ASSERT_EQ(recording.accel[i].stamp_ns, recording.gyro[i].stamp_ns);
  }

  recording = late;
  RepairStamps(StampsMode::kRecorded, &recording);
  EXPECT_FALSE(recording.gyro_stamps->repaired);
  EXPECT_THAT(recording.notes, Contains(HasSubstr("behind them is a clock of 5")));
  for (size_t i = 0; i < recording.gyro.size(); ++i) {
    ASSERT_EQ(recording.gyro[i].stamp_ns, late.gyro[i].stamp_ns);
  }
}

// Frames that are stamped when they arrive keep their stamps, and are to have times of their own.
TEST(RepairStamps, LeavesLateFramesToTheFit) {
  std::mt19937 random(4);
  std::exponential_distribution<double> latency(1.0 / 5e-3);
  Recording late = LateRecording(2e-6);
  for (Frame& frame : late.frames) frame.stamp_ns = StampAt(frame.stamp_ns, latency(random));
  Recording recording = late;
  RepairStamps(StampsMode::kAuto, &recording);
  EXPECT_EQ(recording.camera_stamps->kind, StampKind::kArrival);
  EXPECT_TRUE(recording.camera_stamps->repaired);
  EXPECT_NEAR(recording.camera_stamps->jitter_s, 5e-3, 1e-3);
  EXPECT_THAT(recording.notes, Contains(HasSubstr("each frame has a time of its own in the fit")));
  for (size_t i = 0; i < late.frames.size(); ++i) {
    ASSERT_EQ(recording.frames[i].stamp_ns, late.frames[i].stamp_ns);
  }
  recording = late;
  RepairStamps(StampsMode::kRecorded, &recording);
  EXPECT_EQ(recording.camera_stamps->kind, StampKind::kArrival);
  EXPECT_FALSE(recording.camera_stamps->repaired);
}

// Late frames of which many are missing: no clock is found behind them, but they are late as
// before.
TEST(RepairStamps, LeavesIrregularFramesToTheFit) {
  std::mt19937 random(4);
  std::exponential_distribution<double> work(1.0 / 12e-3);
  Recording recording = LateRecording(2e-6);
  for (size_t i = 1; i < recording.frames.size(); ++i) {
    recording.frames[i].stamp_ns = StampAt(recording.frames[i - 1].stamp_ns, 25e-3 + work(random));
  }
  RepairStamps(StampsMode::kAuto, &recording);
  EXPECT_EQ(recording.camera_stamps->kind, StampKind::kIrregular);
  EXPECT_TRUE(recording.camera_stamps->repaired);
  EXPECT_THAT(recording.notes, Contains(HasSubstr("each frame has a time of its own in the fit")));
  RepairStamps(StampsMode::kRecorded, &recording);
  EXPECT_FALSE(recording.camera_stamps->repaired);
}

TEST(RepairStamps, CleanStampsAreTouchedOnlyOnDemand) {
  const Recording clean = LateRecording(2e-6);
  Recording recording = clean;
  RepairStamps(StampsMode::kAuto, &recording);
  EXPECT_FALSE(recording.gyro_stamps->repaired);
  EXPECT_TRUE(recording.notes.empty());
  for (size_t i = 0; i < clean.gyro.size(); ++i) {
    ASSERT_EQ(recording.gyro[i].stamp_ns, clean.gyro[i].stamp_ns);
  }
  RepairStamps(StampsMode::kRepaired, &recording);
  EXPECT_TRUE(recording.gyro_stamps->repaired);
  EXPECT_NE(recording.gyro[7].stamp_ns, clean.gyro[7].stamp_ns);
  EXPECT_NEAR(SecondsSince(0, recording.gyro[7].stamp_ns), 7 * 5e-3, 2e-5);
}

// A program reads the sensor whenever it comes around to it: the stamps scatter about a clock, but
// they are when the samples were taken, as the rates show.
TEST(RepairStamps, BelievesTheRates) {
  Recording recording = LateRecording(1e-3);
  for (GyroSample& sample : recording.gyro) {
    const double t = SecondsSince(0, sample.stamp_ns);
    sample.omega_gyro_rad_s = {std::sin(9.0 * t), std::cos(7.0 * t), 0.1};
  }
  const std::vector<GyroSample> recorded = recording.gyro;
  RepairStamps(StampsMode::kAuto, &recording);
  EXPECT_FALSE(recording.gyro_stamps->repaired);
  EXPECT_EQ(recording.gyro_stamps->kind, StampKind::kIrregular);
  for (size_t i = 0; i < recorded.size(); ++i) {
    ASSERT_EQ(recording.gyro[i].stamp_ns, recorded[i].stamp_ns);
  }
}

struct MeasuredClock {
  const char* name;
  double period_ms;
  double latest_ms;  // of arrival times; 0: the stamps are clean, and stay as recorded
};
constexpr MeasuredClock kClocks[] = {
    {"phone-edge-hand", 5.00759, 31.8},  {"tango-walk/imu1", 9.4728, 4.8},
    {"tango-walk/imu2", 9.5969, 5.5},    {"tango-walk/imu3", 9.5810, 2.9},
    {"tango-walk/imu4", 9.5847, 2.8},    {"tango-walk/imu5", 9.7094, 4.1},
    {"arkit-attitude/demo1", 10.024, 0}, {"tablet-attitude/D01", 9.9971, 0},
    {"tablet-attitude/D03", 9.9970, 0},  {"iphone-cards", 10.0073, 0},
    {"euroc-v101-flight", 5.0, 0},       {"ov_handheld_rs", 5.0001, 0},
};

TEST(RepairStamps, KnowsMeasuredClocks) {
  for (const MeasuredClock& known : kClocks) {
    SCOPED_TRACE(known.name);
    const auto path = MeasuredData(known.name);
    if (!path) GTEST_SKIP() << known.name << " is not on this machine (CAMGYRO_DATA)";
    const Result<Recording> recording = ReadRecording(*path);
    ASSERT_TRUE(recording) << recording.error().message;
    const StampReport& stamps = *recording->gyro_stamps;
    EXPECT_EQ(stamps.repaired, known.latest_ms > 0.0);
    EXPECT_NEAR(1e3 * stamps.period_s, known.period_ms, 2e-4 * known.period_ms);
    EXPECT_NEAR(1e3 * stamps.latest_s, known.latest_ms, 0.1);
    const Result<Recording> strict = ReadRecording(*path, {StampsMode::kAuto, /*strict=*/true});
    const bool clean = known.latest_ms == 0.0;
    EXPECT_EQ(strict.has_value(), clean);
    EXPECT_TRUE(clean || strict.error().message.find("with strict reading") != std::string::npos);
  }
}

TEST(RepairStamps, KnowsMeasuredFrames) {
  for (const auto& [name, kind] : {std::pair{"phone-edge-hand", StampKind::kArrival},
                                   std::pair{"tango-walk/imu1", StampKind::kMeasured},
                                   std::pair{"ov_handheld_rs", StampKind::kMeasured}}) {
    SCOPED_TRACE(name);
    const auto path = MeasuredData(name);
    if (!path) GTEST_SKIP() << name << " is not on this machine (CAMGYRO_DATA)";
    const Result<Recording> recording = ReadRecording(*path);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->camera_stamps->kind, kind);
  }
}

}  // namespace
}  // namespace camgyro
