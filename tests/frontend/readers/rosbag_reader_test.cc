// ROS 1 bags that the test writes with librosbag. Built where librosbag is.
#include <gmock/gmock.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

sensor_msgs::Imu Imu(double stamp_s, double wx) {
  sensor_msgs::Imu imu;
  imu.header.stamp = ros::Time(stamp_s);
  imu.angular_velocity.x = wx;
  imu.angular_velocity.y = 0.5;
  imu.linear_acceleration.z = 9.75;
  return imu;
}

// 4 x 2 pixels in rows of 16 bytes, all of one value per channel.
sensor_msgs::Image Image(double stamp_s, const std::string& encoding, int channels, uint8_t value) {
  sensor_msgs::Image image;
  image.header.stamp = ros::Time(stamp_s);
  image.encoding = encoding;
  image.width = 4;
  image.height = 2;
  image.step = 16;
  image.data.assign(32, 0);
  for (int row = 0; row < 2; ++row) {
    std::fill_n(image.data.begin() + 16 * row, 4 * channels, value);
  }
  return image;
}

class RosbagReader : public ::testing::Test {
 protected:
  std::string Path() const { return folder_.File("a.bag"); }

  // Two IMU samples, three pictures of different encodings.
  void WriteGood(rosbag::Bag* bag) const {
    bag->open(Path(), rosbag::bagmode::Write);
    const ros::Time arrival(1700000000.0);
    bag->write("/imu", arrival, Imu(1700000000.5, 0.25));
    bag->write("/imu", arrival, Imu(1700000000.505, -0.25));
    bag->write("/cam", arrival, Image(1700000000.25, "mono8", 1, 90));
    bag->write("/cam", arrival, Image(1700000000.5, "rgb8", 3, 120));
    bag->write("/cam", arrival, Image(1700000000.75, "bgra8", 4, 150));
  }

  Error Refusal() const {
    const Result<Recording> recording = ReadRecording(Path());
    return recording ? Error{ErrorKind::kBadUsage, "was read"} : recording.error();
  }

  RecordingFolder folder_;
};

TEST_F(RosbagReader, SamplesAndPictures) {
  rosbag::Bag bag;
  WriteGood(&bag);
  bag.close();
  const Result<Recording> recording = ReadRecording(Path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->gyro.size(), 2u);
  EXPECT_EQ(recording->gyro[0].stamp_ns, 1700000000500000000);  // the header's, not the arrival's
  EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(-0.25, 0.5, 0));
  EXPECT_EQ(recording->accel[1].accel_gyro_m_s2, Eigen::Vector3d(0, 0, 9.75));
  ASSERT_EQ(recording->frames.size(), 3u);
  EXPECT_EQ(recording->frames[1].stamp_ns, 1700000000500000000);
  EXPECT_EQ(recording->camera.width_px, 4);
  EXPECT_EQ(recording->camera.height_px, 2);

  auto source = OpenFrames(*recording);
  ASSERT_TRUE(source) << source.error().message;
  cv::Mat gray;
  for (const int value : {90, 120, 150}) {
    const Result<bool> next = (*source)->Next(&gray);
    ASSERT_TRUE(next) << next.error().message;
    ASSERT_EQ(gray.size(), cv::Size(4, 2));
    EXPECT_EQ(gray.at<uint8_t>(1, 3), value);
  }
  EXPECT_FALSE(*(*source)->Next(&gray));
}

TEST_F(RosbagReader, CompressedPicturesAndManyTopics) {
  rosbag::Bag bag(Path(), rosbag::bagmode::Write);
  bag.setCompression(rosbag::compression::LZ4);
  const ros::Time arrival(1.0);
  for (const char* topic : {"/imu1", "/imu0"}) {
    bag.write(topic, arrival, Imu(10.0, topic[4] == '0' ? 1.0 : 2.0));
    bag.write(topic, arrival, Imu(10.5, topic[4] == '0' ? 1.0 : 2.0));
  }
  for (const double stamp_s : {10.0, 10.5}) {
    sensor_msgs::CompressedImage image;
    image.header.stamp = ros::Time(stamp_s);
    image.format = "png";
    ASSERT_TRUE(cv::imencode(".png", cv::Mat(2, 4, CV_8UC1, cv::Scalar(77)), image.data));
    bag.write("/cam/compressed", arrival, image);
  }
  bag.close();
  const Result<Recording> recording = ReadRecording(Path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->gyro[0].omega_gyro_rad_s.x(), 1.0);
  EXPECT_THAT(recording->notes,
              Contains(HasSubstr("has 2 topics of sensor_msgs/Imu; took /imu0, not /imu1 (")));
  auto source = OpenFrames(*recording);
  ASSERT_TRUE(source);
  cv::Mat gray;
  ASSERT_TRUE((*source)->Next(&gray));
  EXPECT_EQ(gray.at<uint8_t>(0, 0), 77);
}

TEST_F(RosbagReader, WhatIsNotWholeIsRefused) {
  folder_.Write("a.bag", "not a bag at all");
  EXPECT_THAT(Refusal().message, HasSubstr("a.bag: cannot be read as a ROS bag"));

  rosbag::Bag bag;
  WriteGood(&bag);
  bag.close();
  const auto whole = std::filesystem::file_size(Path());
  for (const auto size : {whole - 100, whole / 2, uintmax_t{100}, uintmax_t{13}}) {
    std::filesystem::resize_file(Path(), size);
    EXPECT_EQ(Refusal().kind, ErrorKind::kBadInput) << size;
    EXPECT_THAT(Refusal().message, HasSubstr("a.bag: ")) << size;
  }

  bag.open(Path(), rosbag::bagmode::Write);
  bag.write("/imu", ros::Time(1.0), Imu(1.0, 0));
  bag.close();
  EXPECT_THAT(
      Refusal().message,
      HasSubstr("has no topic of sensor_msgs/Image or CompressedImage; it has /imu (sensor_"));

  WriteGood(&bag);
  bag.write("/imu", ros::Time(1700000000.0), Imu(1700000000.25, 0.25));
  bag.close();
  EXPECT_THAT(Refusal().message, HasSubstr("/imu, message 3: timestamp 1700000000250000000 goes"));

  bag.open(Path(), rosbag::bagmode::Write);
  bag.write("/imu", ros::Time(1.0), Imu(1.0, 0));
  bag.write("/imu", ros::Time(1.0), Imu(1.5, 0));
  bag.write("/cam", ros::Time(1.0), Image(1.0, "yuv444", 1, 9));
  bag.close();
  EXPECT_THAT(Refusal().message, HasSubstr("/cam, message 1: encoding 'yuv444' is not supported"));

  auto image = Image(1.0, "mono8", 1, 9);
  image.data.resize(10);
  bag.open(Path(), rosbag::bagmode::Write);
  bag.write("/imu", ros::Time(1.0), Imu(1.0, 0));
  bag.write("/imu", ros::Time(1.0), Imu(1.5, 0));
  bag.write("/cam", ros::Time(1.0), image);
  bag.close();
  EXPECT_THAT(Refusal().message, HasSubstr("/cam, message 1: the picture's data are cut short"));
}

}  // namespace
}  // namespace camgyro
