// ROS 2 bags that the test writes byte by byte: the same messages in every container give the same
// recording, and nothing that is damaged brings the reader down.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/frontend/readers/ros2_bag_bytes.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

class Ros2Bag : public ::testing::Test {
 protected:
  Error Refusal(const std::string& name) const {
    const Result<Recording> recording = ReadRecording(folder_.File(name));
    return recording ? Error{ErrorKind::kBadUsage, "was read"} : recording.error();
  }

  RecordingFolder folder_;
};

TEST_F(Ros2Bag, EveryContainerGivesTheSameRecording) {
  folder_.Write("plain.mcap", Mcap(Drive(), {}));
  folder_.Write("bare.mcap", Mcap(Drive(), {/*chunks=*/false, /*summary=*/false, ""}));
  folder_.Write("lz4.mcap", Mcap(Drive(), {true, true, "lz4"}));
  folder_.Write("zstd.mcap", Mcap(Drive(), {true, /*summary=*/false, "zstd"}));
  WriteSqlite(folder_.File("a.db3"), Drive());
  WriteSqlite(folder_.File("packed.db3"), Drive(), "zstd");
  folder_.Write("folder/metadata.yaml",
                "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
                "  relative_file_paths:\n    - second.db3\n    - folder/first.db3\n");
  const std::vector<Message> drive = Drive();
  WriteSqlite(folder_.File("folder/second.db3"), {drive.begin(), drive.begin() + 3});
  WriteSqlite(folder_.File("folder/first.db3"), {drive.begin() + 3, drive.end()});
  for (const char* name :
       {"plain.mcap", "bare.mcap", "lz4.mcap", "zstd.mcap", "a.db3", "packed.db3", "folder"}) {
    SCOPED_TRACE(name);
    const Result<Recording> recording = ReadRecording(folder_.File(name));
    ASSERT_TRUE(recording) << recording.error().message;
    ASSERT_EQ(recording->gyro.size(), 2u);
    EXPECT_EQ(recording->gyro[0].stamp_ns, 1700000000500000000);  // of the header
    EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(-0.25, 0.5, 0));
    EXPECT_EQ(recording->accel[1].accel_gyro_m_s2, Eigen::Vector3d(0, 0, 9.75));
    ASSERT_EQ(recording->frames.size(), 3u);
    EXPECT_EQ(recording->frames[1].stamp_ns, 1700000000500000000);
    EXPECT_EQ(recording->camera.width_px, 4);
    EXPECT_EQ(recording->camera.height_px, 2);
    EXPECT_EQ(recording->camera.focal_px, 3.0);
    EXPECT_EQ(recording->camera.principal_px, Eigen::Vector2d(1.5, 0.75));
    EXPECT_EQ(recording->camera.distortion, (std::vector<double>{-0.25, 0.125, 0.001, 0.002}));
    EXPECT_TRUE(recording->notes.empty()) << recording->notes.front();
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
}

// A driver that publishes the accelerometer as an Imu message without rates, and depth images; the
// intrinsics are of another size.
TEST_F(Ros2Bag, TopicsThatCannotBeMeantAreNotTaken) {
  const std::string imu = "sensor_msgs/msg/Imu";
  const std::string compressed = "sensor_msgs/msg/CompressedImage";
  std::vector<Message> messages = {
      {"/accel", imu, Imu(2000000000, 0.0)},
      {"/accel", imu, Imu(1000000000, 0.0)},  // goes back, which does not matter here
      {"/gyro", imu, Imu(1000000000, 0.25)},
      {"/gyro", imu, Imu(1005000000, 0.25)},
      {"/aligned_depth/image", "sensor_msgs/msg/Image", Image(1000000000, "32FC1", 1)},
      {"/color/image/compressed", compressed, CompressedImage(1000000000, 77)},
      {"/color/image/compressed", compressed, CompressedImage(1033000000, 78)},
      {"/color/camera_info", "sensor_msgs/msg/CameraInfo", CameraInfo(640)}};
  folder_.Write("a.mcap", Mcap(messages, {}));
  const Result<Recording> recording = ReadRecording(folder_.File("a.mcap"));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->gyro[1].stamp_ns, 1005000000);
  EXPECT_FALSE(recording->camera.focal_px);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("took /gyro, not /accel (to take another")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("/color/image/compressed, not /aligned_depth")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("camera_info is of 640 x 2 pixels")));
  auto source = OpenFrames(*recording);
  ASSERT_TRUE(source);
  cv::Mat gray;
  ASSERT_TRUE((*source)->Next(&gray));
  EXPECT_EQ(gray.at<uint8_t>(0, 0), 77);
}

TEST_F(Ros2Bag, RecordingYamlChoosesTopics) {
  std::vector<Message> messages = Drive();
  for (const Message& message : Drive()) {
    if (message.topic == "/imu") messages.push_back({"/imu0", message.type, message.data});
  }
  for (const int64_t stamp_ns : {1700000000300000000, 1700000000600000000}) {
    messages.push_back({"/a/image", "sensor_msgs/msg/Image", Image(stamp_ns, "mono8", 33)});
  }
  folder_.Write("chosen/a.mcap", Mcap(messages, {}));
  folder_.Write("chosen/recording.yaml",
                "bag:\n  file: a.mcap\n  imu_topic: /imu0\n  image_topic: /cam/image_raw\n");
  const std::pair<const char*, int> cases[] = {{"chosen", 90}, {"chosen/a.mcap", 33}};
  for (const auto& [name, value] : cases) {
    const Result<Recording> recording = ReadRecording(folder_.File(name));
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->notes.empty(), value == 90);  // nothing is open where all is named
    auto source = OpenFrames(*recording);
    ASSERT_TRUE(source) << source.error().message;
    cv::Mat gray;
    ASSERT_TRUE((*source)->Next(&gray));
    EXPECT_EQ(gray.at<uint8_t>(0, 0), value);
  }
}

TEST_F(Ros2Bag, OfAnInterruptedRecordingWhatIsThereIsTaken) {
  const std::string whole = Mcap(Drive(), {/*chunks=*/false, /*summary=*/false, ""});
  const size_t last_message = whole.rfind("yuv422_yuy2");
  folder_.Write("a.mcap", whole.substr(0, last_message));
  const Result<Recording> recording = ReadRecording(folder_.File("a.mcap"));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->frames.size(), 2u);
  EXPECT_EQ(recording->gyro.size(), 2u);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("the recording was interrupted")));
}

TEST_F(Ros2Bag, WhatCannotBeReadIsRefusedWithItsPlace) {
  folder_.Write("a.mcap", "not a bag at all");
  EXPECT_THAT(Refusal("a.mcap").message, HasSubstr("a.mcap: is no MCAP file of version 0"));
  folder_.Write("a.db3", "not a bag at all, and this at some length");
  EXPECT_THAT(Refusal("a.db3").message, HasSubstr("a.db3: cannot be read as a bag of ROS 2"));
  folder_.Write("a.mcap.zstd", "");
  EXPECT_THAT(Refusal("a.mcap.zstd").message, HasSubstr("unpack it with `zstd -d`"));

  folder_.Write("a.mcap", Mcap(Drive(), {true, true, "", "ros1"}));
  EXPECT_THAT(Refusal("a.mcap").message, HasSubstr("has no topic of sensor_msgs/Imu; it has"));
  EXPECT_THAT(Refusal("a.mcap").message, HasSubstr("/imu (sensor_msgs/msg/Imu, encoded as ros1)"));

  std::vector<Message> messages = Drive();
  messages[2].data.resize(60);
  folder_.Write("a.mcap", Mcap(messages, {}));
  EXPECT_THAT(Refusal("a.mcap").message,
              HasSubstr("/cam/image_raw, message 1: the message is cut short"));
  messages[2].data = "\x05";
  WriteSqlite(folder_.File("a.db3"), messages);
  EXPECT_THAT(Refusal("a.db3").message, HasSubstr("/cam/image_raw, message 1: is no plain CDR"));

  // Rows of 4 (2^30 + 1) bytes are 4 bytes in 32 bits.
  messages[2].data = Image(1, "rgba8", 0, (1u << 30) + 1);
  folder_.Write("a.mcap", Mcap(messages, {}));
  EXPECT_THAT(Refusal("a.mcap").message, HasSubstr("has 1073741825 x 2 pixels, more than any"));
}

TEST_F(Ros2Bag, SizesThatAFileClaimsAreNotBelieved) {
  folder_.Write("a.mcap", Mcap(Drive(), {true, true, "zstd", "cdr", int64_t{1} << 60}));
  EXPECT_THAT(Refusal("a.mcap").message, HasSubstr("a chunk claims 1152921504606846976 bytes"));
  for (const char* compression : {"lz4", "zstd"}) {
    folder_.Write("a.mcap", Mcap(Drive(), {true, true, compression, "cdr", 10}));
    EXPECT_THAT(Refusal("a.mcap").message, HasSubstr("unpacks to more than the 10 bytes"));
  }
  folder_.Write("a.mcap", Mcap(Drive(), {true, true, "brotli"}));
  EXPECT_THAT(Refusal("a.mcap").message, HasSubstr("'brotli' is not supported"));
}

TEST_F(Ros2Bag, MetadataNamesFilesOfItsFolderOnly) {
  WriteSqlite(folder_.File("outside.db3"), Drive());
  std::filesystem::create_directories(folder_.File("bag"));
  WriteSqlite(folder_.File("bag/a.db3"), Drive());
  const std::string outside = folder_.File("outside.db3");
  for (const std::string& name : {std::string("../outside.db3"), outside,
                                  std::string("sub/../../outside.db3"), std::string("''")}) {
    folder_.Write("bag/metadata.yaml",
                  "rosbag2_bagfile_information: {relative_file_paths: [" + name + "]}");
    EXPECT_THAT(Refusal("bag").message, HasSubstr("expected one inside of the recording's folder"))
        << name;
  }
  folder_.Write("bag/metadata.yaml",
                "rosbag2_bagfile_information: {relative_file_paths: [no.db3]}");
  EXPECT_THAT(Refusal("bag").message, HasSubstr("no.db3: cannot be read"));
  folder_.Write("bag/metadata.yaml", "- 1\n- [\n");
  EXPECT_THAT(Refusal("bag").message, HasSubstr("metadata.yaml:3: not valid YAML"));
  folder_.Write("bag/metadata.yaml", "nothing: here\n");
  EXPECT_THAT(Refusal("bag").message, HasSubstr("metadata.yaml: lists no files"));
  folder_.Remove("bag/metadata.yaml");
  EXPECT_TRUE(ReadRecording(folder_.File("bag")));
}

// Every single damaged byte, and every length: an answer, whatever it is.
TEST_F(Ros2Bag, DamageIsSurvived) {
  const std::vector<Message> drive = Drive();
  const std::vector<Message> some = {drive.begin() + 1, drive.begin() + 6};
  WriteSqlite(folder_.File("whole.db3"), some);
  std::ifstream in(folder_.File("whole.db3"), std::ios::binary);
  const std::string sqlite{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::pair<std::string, std::string> wholes[] = {
      {"a.mcap", Mcap(some, {})},
      {"b.mcap", Mcap(some, {true, false, "lz4"})},
      {"c.mcap", Mcap(some, {true, true, "zstd"})},
      {"d.db3", sqlite}};
  for (const auto& [name, whole] : wholes) {
    const size_t step = name == "d.db3" ? 97 : 11;  // a database is mostly empty pages
    int refused = 0;
    for (size_t at = 0; at < whole.size(); at += step) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(~damaged[at]);
      folder_.Write(name, damaged);
      const Result<Recording> flipped = ReadRecording(folder_.File(name));
      folder_.Write(name, whole.substr(0, at));
      const Result<Recording> cut = ReadRecording(folder_.File(name));
      for (const auto* result : {&flipped, &cut}) {
        if (*result) continue;
        ++refused;
        ASSERT_EQ(result->error().kind, ErrorKind::kBadInput) << name << " " << at;
        ASSERT_THAT(result->error().message, HasSubstr(name)) << at;
      }
    }
    EXPECT_GT(refused, 20) << name;
  }
}

}  // namespace
}  // namespace camgyro
