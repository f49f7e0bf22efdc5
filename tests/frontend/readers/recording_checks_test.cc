#include "frontend/readers/recording_checks.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>

namespace camgyro {
namespace {

using testing::HasSubstr;

constexpr int64_t kInterval = 5'000'000;

Eigen::Vector3d Rate(double t_s) {
  return {std::sin(3.0 * t_s), 0.3 * std::cos(2.0 * t_s), 0.1 * t_s};
}

std::vector<GyroSample> CleanSamples(int count) {
  std::vector<GyroSample> samples;
  for (int i = 0; i < count; ++i)
    samples.push_back({1'000'000'000 + i * kInterval, Rate(5e-3 * i)});
  return samples;
}

Status Collect(const std::vector<GyroSample>& samples, Recording* recording) {
  GyroCollector collector(recording);
  int line = 0;
  for (const GyroSample& sample : samples) {
    ++line;
    collector.Add(sample, Eigen::Vector3d(0.0, 0.0, static_cast<double>(line)),
                  [&] { return "gyro.csv:" + std::to_string(line); });
  }
  return collector.Finish("gyro.csv");
}

TEST(GyroCollector, LeavesOutTheFewStampsThatStepBackAndSaysWhere) {
  std::vector<GyroSample> samples = CleanSamples(400);
  samples[100].stamp_ns -= 2 * kInterval;      // back by 10 ms
  samples[300].stamp_ns += 1'000 * kInterval;  // ahead of all that follow
  Recording recording;
  ASSERT_TRUE(Collect(samples, &recording));
  ASSERT_EQ(recording.gyro.size(), 398u);
  ASSERT_EQ(recording.accel.size(), 398u);
  for (size_t i = 0; i < 398; ++i) {  // those that are left are the others, in their order
    const size_t j = i + (i >= 100 ? 1 : 0) + (i >= 299 ? 1 : 0);
    EXPECT_EQ(recording.gyro[i].stamp_ns, samples[j].stamp_ns);
    EXPECT_EQ(recording.gyro[i].omega_gyro_rad_s, samples[j].omega_gyro_rad_s);
    EXPECT_EQ(recording.accel[i].accel_gyro_m_s2.z(), static_cast<double>(j + 1));
  }
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].name, "stamps_step_back");
  EXPECT_EQ(recording.faults[0].count, 2);
  EXPECT_THAT(recording.faults[0].finding, HasSubstr("gyro.csv:101: timestamp"));
  EXPECT_EQ(recording.notes.size(), 1u);
}

TEST(GyroCollector, OfEqualStampsTheFirstIsUsed) {
  std::vector<GyroSample> samples = CleanSamples(400);
  samples[51].stamp_ns = samples[50].stamp_ns;
  Recording recording;
  ASSERT_TRUE(Collect(samples, &recording));
  EXPECT_EQ(recording.gyro.size(), 399u);
  EXPECT_EQ(recording.gyro[50].omega_gyro_rad_s, samples[50].omega_gyro_rad_s);
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].name, "stamps_repeat");
  EXPECT_THAT(recording.faults[0].finding, HasSubstr("gyro.csv:52: timestamp"));
}

// Packets of eight samples with the stamp of the last: all are samples, and the clock orders them.
TEST(GyroCollector, EqualStampsOfPacketsStay) {
  std::vector<GyroSample> samples = CleanSamples(400);
  for (size_t i = 0; i < samples.size(); ++i) samples[i].stamp_ns = samples[i / 8 * 8 + 7].stamp_ns;
  Recording recording;
  ASSERT_TRUE(Collect(samples, &recording));
  EXPECT_EQ(recording.gyro.size(), 400u);
  EXPECT_TRUE(recording.faults.empty());
}

TEST(MendAccel, LeavesOutWhatDoesNotFit) {
  Recording recording;
  for (int i = 0; i < 100; ++i) recording.accel.push_back({i * kInterval, {0.0, 0.0, 1.0 * i}});
  recording.accel[40].stamp_ns = recording.accel[39].stamp_ns;
  recording.accel[70].stamp_ns -= 3 * kInterval;
  MendAccel("accel.csv", &recording);
  ASSERT_EQ(recording.accel.size(), 98u);
  for (const AccelSample& sample : recording.accel) {
    EXPECT_EQ(sample.stamp_ns, std::lround(sample.accel_gyro_m_s2.z()) * kInterval);
  }
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].name, "accel_stamps");
  EXPECT_EQ(recording.faults[0].count, 2);
  EXPECT_THAT(recording.faults[0].finding, HasSubstr("accel.csv: 2 of 100"));
}

// No calibration needs the accelerometer: its stamps are no reason to refuse a recording.
TEST(MendAccel, LeavesOutAnAccelerometerThatIsNotInOrder) {
  Recording recording;
  for (int i = 0; i < 100; ++i) recording.accel.push_back({i / 2 * kInterval, {0.0, 0.0, 9.8}});
  MendAccel("accel.csv", &recording);
  EXPECT_TRUE(recording.accel.empty());
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].count, 50);
  EXPECT_THAT(recording.faults[0].finding, HasSubstr("the accelerometer is not used"));

  recording = {};
  for (int i = 0; i < 100; ++i) recording.accel.push_back({i * kInterval, {0.0, 0.0, 9.8}});
  MendAccel("accel.csv", &recording);
  EXPECT_EQ(recording.accel.size(), 100u);
  EXPECT_TRUE(recording.faults.empty());
}

TEST(GyroCollector, RefusesTwoStreamsInOneFile) {
  // One behind the other.
  std::vector<GyroSample> samples = CleanSamples(200);
  const std::vector<GyroSample> again = samples;
  samples.insert(samples.end(), again.begin(), again.end());
  Recording behind;
  Status status = Collect(samples, &behind);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("gyro.csv:201: timestamp 1000000000 goes back"));
  EXPECT_THAT(status.error().message, HasSubstr("two streams in one file"));

  // In turns, with stamps of their own, and mounted in different ways.
  samples.clear();
  for (const GyroSample& sample : again) {
    samples.push_back(sample);
    const Eigen::Vector3d& w = sample.omega_gyro_rad_s;
    samples.push_back({sample.stamp_ns + 2'000'000, {w.y() + 0.02, -w.x(), w.z()}});
  }
  Recording turns;
  status = Collect(samples, &turns);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("every other sample is of another sensor"));
}

TEST(GyroCollector, NamesAnAxisThatIsConstant) {
  std::vector<GyroSample> samples = CleanSamples(200);
  for (GyroSample& sample : samples) sample.omega_gyro_rad_s.y() = 0.25;
  Recording recording;
  ASSERT_TRUE(Collect(samples, &recording));
  ASSERT_EQ(recording.notes.size(), 1u);
  EXPECT_THAT(recording.notes[0], HasSubstr("all 200 rates about y"));
  EXPECT_TRUE(recording.faults.empty());  // those are mended
  samples[120].omega_gyro_rad_s.y() = 0.2501;
  Recording sound;
  ASSERT_TRUE(Collect(samples, &sound));
  EXPECT_TRUE(sound.notes.empty());
}

}  // namespace
}  // namespace camgyro
