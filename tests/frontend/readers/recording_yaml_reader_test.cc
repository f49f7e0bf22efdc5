// Any csv, described by a recording.yaml.
#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/frontend/readers/logger_folder.h"
#include "tests/frontend/readers/sound_logs.h"

namespace camgyro {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(RecordingYamlReader, AnyTablesWithAVideo) {
  const LoggerFolder folder;
  folder.Write(In("log", kDescribed));
  folder.WriteVideo("clip.mp4");
  for (const std::string& path : {folder.path(), folder.File("recording.yaml")}) {
    const Result<Recording> recording = ReadRecording(path);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->path, path);
    EXPECT_THAT(Stamps(*recording), ElementsAre(100500000000, 100540000000, 100580000000));
    EXPECT_DOUBLE_EQ(recording->frames[2].exposure_s, 0.01);
    ASSERT_EQ(recording->gyro.size(), 2u);
    EXPECT_EQ(recording->gyro[1].stamp_ns, 100505000000);
    EXPECT_TRUE(
        recording->gyro[1].omega_gyro_rad_s.isApprox(Eigen::Vector3d(M_PI, M_PI / 3, M_PI / 6)));
    EXPECT_EQ(recording->accel[1].stamp_ns, 100505000000);
    EXPECT_TRUE(recording->accel[1].accel_gyro_m_s2.isApprox(Eigen::Vector3d(0, 9.80665, 0)));
    EXPECT_EQ(recording->camera.focal_px, 40.0);
    EXPECT_EQ(recording->camera.readout_s, 0.02);
    ExpectPictures(*recording);
  }
}

TEST(RecordingYamlReader, Images) {
  const LoggerFolder folder;
  Files files = kDescribed;
  files["recording.yaml"] =
      "gyro: {file: sensors/gyro.csv, separator: ';', time: t_us, time_unit: us,\n"
      "       columns: [wx, wy, wz], unit: deg/s}\n"
      "camera: {images: pictures, frames: frames.csv, time: 1, time_unit: ms, image: 2}\n";
  files["frames.csv"] = "500,a.png\n540,b.png\n";
  folder.Write(In("log", files));
  std::filesystem::create_directories(folder.File("pictures"));
  for (const char* name : {"pictures/a.png", "pictures/b.png", "out.png"}) {
    ASSERT_TRUE(cv::imwrite(folder.File(name), cv::Mat(48, 64, CV_8UC1, cv::Scalar(9))));
  }
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(Stamps(*recording), ElementsAre(500000000, 540000000));
  ExpectPictures(*recording);
  ExpectComplaints(
      folder, files,
      {{"frames.csv", "b.png", "../out.png", "frames.csv:2: names the file '../out.png', expected"},
       {"frames.csv", "b.png", "/etc/passwd", "frames.csv:2: names the file '/etc/passwd'"},
       {"frames.csv", "b.png", "c.png", "c.png does not exist, expected an image"},
       {"recording.yaml", "image: 2", "image: 3", "frames.csv: has 2 columns, no number 3"},
       {"recording.yaml", "frames: frames.csv, ", "", "recording.yaml: frames: is missing below"}});
}

TEST(RecordingYamlReader, WhatItCannotMeanIsRefused) {
  const LoggerFolder folder;
  folder.Write(In("log", kDescribed));
  folder.WriteVideo("clip.mp4");
  folder.WriteVideo("../outside.mp4");
  ExpectComplaints(
      folder, kDescribed,
      {{"recording.yaml", "unit: deg/s", "units: deg/s", "recording.yaml:8: unknown key `units`"},
       {"recording.yaml", "unit: deg/s", "unit: rpm", "recording.yaml:8: unit: 'rpm' was found"},
       {"recording.yaml", "time_unit: us", "time_unit: min", "expected one of ms, ns, s, us"},
       {"recording.yaml", "time: t_us", "time: t", "gyro.csv: the header is n,wz,t_us,wy,wx"},
       {"recording.yaml", "[wx, wy, wz]", "[wx, wy]", "recording.yaml:7: columns: expected [x, y"},
       {"recording.yaml", "clip.mp4", "../outside.mp4",
        "recording.yaml:16: video: '../outside.mp4'"},
       {"recording.yaml", "sensors/gyro.csv", "/dev/zero", "recording.yaml:2: file: '/dev/zero'"},
       {"recording.yaml", "camera.yaml", "no.yaml", "no.yaml: cannot be opened"},
       {"recording.yaml", "  video: clip.mp4\n", "", "expected either `video` or `images`"},
       {"recording.yaml", "time_offset_s: 100", "time_offset_s: 1e99",
        "recording.yaml:6: time_offset"},
       {"recording.yaml", "gyro:", "giro:", "recording.yaml:1: unknown key `giro`, expected gyro"},
       {"recording.yaml", "gyro:\n", "gyro: [\n", "not valid YAML"},
       {"sensors/gyro.csv", "180", "x", "gyro.csv:3: column 5, wx: 'x' was found"},
       {"sensors/gyro.csv", "505000", "9e300", "gyro.csv:3: column 3, t_us: '9e300' was found"}});
}

TEST(RecordingYamlReader, ChoosesTopicsOfABag) {
  const LoggerFolder folder;
  folder.Write({{"log/recording.yaml", "bag: {file: a.mcap, imu_topic: /imu1}\n"},
                {"log/a.mcap", "no MCAP"},
                {"log/b.txt", "no bag"}});
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_FALSE(recording);
  EXPECT_THAT(recording.error().message, HasSubstr("a.mcap: is no MCAP file"));
  const Files files = {{"recording.yaml", "bag: {file: a.mcap, imu_topic: /imu1}\n"}};
  ExpectComplaints(
      folder, files,
      {{"recording.yaml", "a.mcap", "b.txt", "b.txt: expected a ROS bag"},
       {"recording.yaml", "a.mcap", "../a.mcap", "recording.yaml:1: file: '../a.mcap'"},
       {"recording.yaml", "imu_topic", "topic", "unknown key `topic`"}});
}

TEST(RecordingYamlReader, DamageIsSurvived) {
  const LoggerFolder folder;
  folder.Write(In("log", kDescribed));
  folder.WriteVideo("clip.mp4");
  ExpectSurvivesDamage(folder, "", kDescribed);
}

}  // namespace
}  // namespace camgyro
