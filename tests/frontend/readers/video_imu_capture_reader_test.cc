// VideoIMUCapture's protobuf, written byte by byte.
#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/frontend/readers/video_meta_bytes.h"
#include "tests/frontend/readers/write_video.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

using namespace video_meta;  // NOLINT(google-build-using-namespace)

class VideoImuCapture : public ::testing::Test {
 protected:
  void SetUp() override {
    // Is protobuf in this build? It says so otherwise.
    folder_.Write("log/video_meta.pb3", "");
    const Result<Recording> recording = ReadRecording(folder_.File("log"));
    ASSERT_FALSE(recording);
    if (recording.error().message.find("built without the library") != std::string::npos) {
      GTEST_SKIP() << "built without protobuf";
    }
  }

  Result<Recording> Read(const std::string& meta) const {
    folder_.Write("log/video_meta.pb3", meta);
    VideoSpec spec;
    spec.pictures.assign(4, cv::Mat(48, 64, CV_8UC1, cv::Scalar(90)));  // 40 ms apart
    EXPECT_TRUE(WriteVideo(folder_.File("log/video_recording.mp4"), spec));
    return ReadRecording(folder_.File("log"));
  }

  // Everything in the order of arrival; picture 2 has no metadata.
  const std::string camera_ = Bytes(1, Whole(1, 1600000000)) + Bytes(2, Whole(3, 1) + Whole(4, 1));
  const std::string good_ = camera_ + Imu(1000000000, {0.25f, 0.5f, 0.75f}) +
                            Picture(1000000000, 0) + Imu(1005000000, {-0.25f, 0.5f, 0.75f}) +
                            Picture(1040100000, 1) + Picture(1120000000, 3);
  RecordingFolder folder_;
};

TEST_F(VideoImuCapture, IsRead) {
  const Result<Recording> recording = Read(good_);
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->gyro.size(), 2u);
  EXPECT_EQ(recording->gyro[1].stamp_ns, 1005000000);
  EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(-0.25, 0.5, 0.75));
  EXPECT_EQ(recording->accel[0].accel_gyro_m_s2, Eigen::Vector3d(0, 0.5, 9.75));
  ASSERT_EQ(recording->frames.size(), 4u);
  EXPECT_EQ(recording->frames[1].stamp_ns, 1040100000);
  // Shifted by the median of 1000, 1000.1, 1000 ms.
  EXPECT_EQ(recording->frames[2].stamp_ns, 1080000000);
  EXPECT_TRUE(std::isnan(recording->frames[2].exposure_s));
  EXPECT_DOUBLE_EQ(recording->frames[3].exposure_s, 0.005);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("no stamps for 1 of 4 pictures")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("optical image stabilisation")));
  EXPECT_EQ(*recording->declared_stabilisation, "video_stabilization");
  EXPECT_DOUBLE_EQ(*recording->camera.focal_px, 512.5);
  EXPECT_DOUBLE_EQ(*recording->camera.readout_s, 0.02);
}

// Android counts in pixels of the sensor, here four of the picture's.
TEST_F(VideoImuCapture, SaysWhereTheLensWas) {
  const auto pictures = [](float x) {
    return Imu(1000000000, {0.25f, 0.5f, 0.75f}) + Imu(1005000000, {-0.25f, 0.5f, 0.75f}) +
           Picture(1000000000, 0, LensPosition(1002000000, 4.0f, 8.0f)) +
           Picture(1040000000, 1, LensPosition(1041000000, x, 8.0f)) +
           Picture(1080000000, 2, LensPosition(1081000000, 4.0f, 8.0f)) +
           Picture(1120000000, 3, LensPosition(1121000000, 4.0f, 8.0f));
  };
  const std::string sensor = Bytes(2, Whole(3, 1) + Bytes(12, Whole(1, 256) + Whole(2, 192)));
  const Result<Recording> recording = Read(sensor + pictures(-6.0f));
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->lens_shift.size(), 4u);
  EXPECT_EQ(recording->lens_shift[1].stamp_ns, 1041000000);
  EXPECT_EQ(recording->lens_shift[1].shift_px, Eigen::Vector2d(-1.5, 2.0));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("by up to 2.5 px")));
  const Result<Recording> unknown = Read(camera_ + pictures(-6.0f));
  ASSERT_TRUE(unknown) << unknown.error().message;
  EXPECT_TRUE(unknown->lens_shift.empty());
  EXPECT_THAT(unknown->notes, Contains(HasSubstr("has no width of the sensor")));
  const Result<Recording> wild = Read(sensor + pictures(std::nanf("")));
  ASSERT_FALSE(wild);
  EXPECT_THAT(wild.error().message, HasSubstr("stamp 1041000000: a shift of nan px"));
}

TEST_F(VideoImuCapture, WhatIsNotWholeIsRefused) {
  const size_t last = good_.size() - Picture(1120000000, 3).size();
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "has 0 samples"},
      {good_.substr(0, good_.size() - 1),
       "record 7, at byte " + std::to_string(last) + ": the file is cut short"},
      {good_.substr(0, last + 1), "the file is cut short"},
      {"this is text", "record 1, at byte 0: is damaged"},
      {good_ + Imu(1004000000, {0, 0, 0}), "record 8,"},
      {good_ + Imu(1004000000, {0, 0, 0}), "timestamp 1004000000 goes back"},
      {good_ + Imu(1010000000, {0, 0}), "gyro has 2 and accel 3 values, expected 3"},
      {good_ + Imu(1010000000, {0, std::nanf(""), 0}), "not finite"},
      {good_ + Picture(1160000000, 4), "has a picture number 4, but the video has 4"},
      {good_ + Picture(1160000000, 3), "picture 3 is there twice"},
      {good_ + Picture(1030000000, 2), "frame 3: timestamp 1030000000 goes back"},
      {camera_ + Imu(1, {0, 0, 0}) + Imu(10000000, {0, 0, 0}), "has no pictures"},
  };
  for (const auto& [meta, complaint] : cases) {
    const Result<Recording> recording = Read(meta);
    ASSERT_FALSE(recording) << complaint;
    EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(recording.error().message, HasSubstr(complaint));
    EXPECT_THAT(recording.error().message, HasSubstr("video_meta.pb3: "));
  }
}

}  // namespace
}  // namespace camgyro
