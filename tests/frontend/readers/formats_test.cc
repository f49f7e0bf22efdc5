// The table of formats: complete, documented, and told apart.
#include "frontend/readers/formats.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/paths.h"

namespace camgyro {
namespace {

using ::testing::HasSubstr;

TEST(RecordingFormats, AreNamedOnceAndDocumented) {
  std::ifstream in(SourceDir() + "/docs/recording_format.md");
  const std::string document{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::set<std::string> names;
  for (const RecordingFormat& format : RecordingFormats()) {
    EXPECT_TRUE(names.insert(format.name).second) << format.name << " stands twice";
    EXPECT_THAT(document, HasSubstr(format.name));
    EXPECT_TRUE(format.read != nullptr || *format.needs != '\0') << format.name;
  }
}

TEST(RecordingFormats, AreToldByTheirFiles) {
  const RecordingFolder folder;  // with cam0/ and imu0/
  folder.Write({{"stray/odometry.csv", ""}, {"ios/Frames.txt", ""}});
  const std::pair<const char*, const char*> cases[] = {
      {"", "EuRoC/ASL folder"},
      {"capture/video_meta.pb3", "VideoIMUCapture"},
      {"mars/gyro_accel.csv", "MARSLogger"},
      {"sensors/Gyroscope.csv", "Sensor Logger"},
      {"stray/imu.csv", "Stray Scanner"},
      {"ios/Gyro.txt", "ios_logger"},
      {"lines/data.jsonl", "JSON lines"},
      {"described/recording.yaml", "recording.yaml"},
      {"bag/a_0.db3", "ROS 2 bag"},
      {"clip.mcap", "ROS 2 bag"},
      {"clip.bag", "ROS 1 bag"},
      {"clip.gcsv", "Gyroflow"},
  };
  for (const auto& [file, name] : cases) {
    const bool is_file = std::string(file).find("clip") == 0;
    if (*file != '\0') folder.Write(file, "");
    const std::filesystem::path path = folder.File(file);
    const RecordingFormat* format = FindFormat((is_file ? path : path.parent_path()).string());
    ASSERT_NE(format, nullptr) << file;
    EXPECT_STREQ(format->name, name) << file;
  }
  std::filesystem::create_directories(folder.File("empty"));
  EXPECT_EQ(FindFormat(folder.File("empty")), nullptr);
}

TEST(RecordingFormats, OneThatThisBuildCannotReadSaysWhatItNeeds) {
  RecordingFormat format = RecordingFormats().front();
  EXPECT_TRUE(CheckBuilt(format, "x"));
  format.read = nullptr;
  format.needs = "libthis-dev";
  const Status built = CheckBuilt(format, "a.xyz");
  ASSERT_FALSE(built);
  EXPECT_THAT(built.error().message, HasSubstr("a.xyz: a recording of the format EuRoC/ASL"));
  EXPECT_THAT(built.error().message, HasSubstr("(libthis-dev)"));
}

TEST(RecordingFormats, AreListedWhereNothingIsThere) {
  const Result<Recording> recording = ReadRecording("no/such/recording");
  ASSERT_FALSE(recording);
  for (const RecordingFormat& format : RecordingFormats()) {
    EXPECT_THAT(recording.error().message, HasSubstr(format.name));
  }
}

}  // namespace
}  // namespace camgyro
