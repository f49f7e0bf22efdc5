// What is wrong with a folder is refused with file, line and expectation.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <opencv2/imgcodecs.hpp>
#include <utility>
#include <vector>

#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"

namespace camgyro {
namespace {

using ::testing::HasSubstr;

const char kRemoved[] = "(removed)";

struct Malformed {
  const char* name;
  const char* file;     // which is replaced by
  const char* content;  // (or removed)
  std::vector<const char*> complaint;
};

// clang-format off
const Malformed kMalformed[] = {
  {"GyroMissing", "imu0/data.csv", kRemoved, {"imu0/data.csv: cannot be opened"}},
  {"GyroEmpty", "imu0/data.csv", "", {"imu0/data.csv: has 0 samples, expected at least two"}},
  {"GyroOneSample", "imu0/data.csv", "#t,x,y,z\n1,2,3,4\n", {"imu0/data.csv: has 1 samples, expected at least two"}},
  {"GyroEmptyCell", "imu0/data.csv", "#t,x,y,z\n1000000,1,2,3\n2000000,1,,3\n",
   {"imu0/data.csv:3:", "column 3, w_y [rad s^-1]", "cell is empty", "expected a finite number"}},
  {"GyroNan", "imu0/data.csv", "1000000,1,2,3\n2000000,1,2,nan\n",
   {"imu0/data.csv:2:", "column 4, w_z", "'nan'", "expected a finite number"}},
  {"GyroInf", "imu0/data.csv", "1000000,-inf,2,3\n2000000,1,2,3\n", {"imu0/data.csv:1:", "'-inf'", "expected a finite number"}},
  {"GyroWord", "imu0/data.csv", "#t,x,y,z\n\n1000000,1,2,3\n2000000,1,2,3.0x\n",
   {"imu0/data.csv:4:", "'3.0x'", "expected a finite number"}},
  {"GyroHugeNumber", "imu0/data.csv", "1000000,1e999,2,3\n", {"imu0/data.csv:1:", "'1e999'", "expected a finite number"}},
  {"GyroColumns", "imu0/data.csv", "1000000,1,2\n", {"imu0/data.csv:1:", "has 3 columns", "expected 4 (", "or 7 ("}},
  {"GyroHalfRow", "imu0/data.csv", "#t,x,y,z\n1000000,1,2,3\n2000000,1,2,3\n30000",
   {"imu0/data.csv:4:", "has 1 column,", "expected 4 (timestamp [ns]"}},
  {"GyroSeparator", "imu0/data.csv", "1000000;1;2;3\n2000000;1;2;3\n", {"imu0/data.csv:2:", "has 1 column", "expected 4"}},
  {"GyroWidthChanges", "imu0/data.csv", "1000000,1,2,3\n2000000,1,2,3,4,5,6\n", {"imu0/data.csv:2:", "has 7 columns", "expected 4"}},
  {"GyroStampInSeconds", "imu0/data.csv", "1.5,1,2,3\n1.6,1,2,3\n",
   {"imu0/data.csv:1:", "'1.5'", "expected an integer number of nanoseconds"}},
  {"GyroStampInMilliseconds", "imu0/data.csv", "1000,1,2,3\n1005,1,2,3\n1010,1,2,4\n",
   {"imu0/data.csv:", "5 ns", "expected stamps in nanoseconds"}},
  {"GyroStampTooLong", "imu0/data.csv", "99999999999999999999,1,2,3\n", {"imu0/data.csv:1:", "expected an integer number"}},
  {"GyroRepeats", "imu0/data.csv", "1000000,1,2,3\n2000000,1,2,3\n2000000,1,2,4\n",
   {"imu0/data.csv:3:", "2000000 repeats with other values, after 2000000", "expected strictly increasing"}},
  {"AccelRepeats", "imu0/data.csv", "1000000,1,2,3,4,5,6\n2000000,1,2,3,4,5,6\n2000000,1,2,3,4,5,7\n",
   {"imu0/data.csv:3:", "2000000 repeats with other values, after 2000000", "expected strictly increasing"}},
  {"GyroGoesBack", "imu0/data.csv", "1000000,1,2,3\n3000000,1,2,3\n2000000,1,2,4\n",
   {"imu0/data.csv:3:", "2000000 goes back, after 3000000", "expected strictly increasing"}},
  {"GyroDegrees", "imu0/data.csv", "1000000,100,2,3\n2000000,-100,2,3\n3000000,90,0,2\n",
   {"imu0/data.csv:", "looks like deg/s", "must be rad/s", "[deg s^-1]"}},
  {"GyroMixedUnits", "imu0/data.csv", "#t,x [rad/s],y [deg/s],z [rad/s]\n1000000,1,2,3\n",
   {"imu0/data.csv:1:", "degrees for 1 of the three", "expected one unit"}},
  {"GyroNoise", "imu0/sensor.yaml", "rate_hz: 50\ngyroscope_noise_density: -1\n",
   {"imu0/sensor.yaml:2:", "gyroscope_noise_density", "-1", "expected more than zero"}},

  {"FramesRepeat", "cam0/data.csv", "#t\n1000000000\n1033000000\n1033000000\n",
   {"cam0/data.csv:4:", "1033000000 repeats, after 1033000000", "expected strictly increasing"}},
  {"FramesGoBack", "cam0/data.csv", "#t\n1000000000\n1066000000\n1033000000\n",
   {"cam0/data.csv:4:", "1033000000 goes back, after 1066000000", "expected strictly increasing"}},
  {"FramesTooFew", "cam0/data.csv", "#t\n1000000000\n", {"cam0/data.csv: has 1 frames, expected at least two"}},
  {"FrameStampEmpty", "cam0/data.csv", "#t,filename\n1000000000,\n,\n", {"cam0/data.csv:3:", "timestamp [ns]", "cell is empty", "expected an integer"}},
  {"FrameNameInSomeRows", "cam0/data.csv", "1000000000,a.png\n1033000000,\n", {"cam0/data.csv:2:", "filename", "expected a name in every row"}},
  {"FrameImageMissing", "cam0/data.csv", "#t,f\n1000000000,a.png\n1033000000,b.png\n",
   {"cam0/data.csv:3:", "cam0/data/b.png does not exist", "expected an image"}},
  {"FrameImageOutside", "cam0/data.csv", "#t,f\n1000000000,a.png\n1033000000,../../secret.png\n",
   {"cam0/data.csv:3:", "names the file '../../secret.png'", "expected one inside of the recording's folder"}},
  {"FrameImageAbsolute", "cam0/data.csv", "#t,f\n1000000000,/etc/passwd\n1033000000,a.png\n",
   {"cam0/data.csv:2:", "names the file '/etc/passwd'"}},
  {"FrameExposureInNanoseconds", "cam0/data.csv", "1000000000,,5000000\n1033000000,,0.005\n",
   {"cam0/data.csv:1:", "exposure [s]", "5e+06 s", "expected seconds"}},
  {"FrameStampsInMicroseconds", "cam0/data.csv", "1000000\n1033300\n1066600\n", {"cam0: ", "33300 ns", "expected stamps in nanoseconds"}},
  {"FastFrameStampsInMicroseconds", "cam0/data.csv", "1000000\n1003300\n1006600\n", {"cam0: ", "3300 ns", "expected stamps in nanoseconds"}},

  {"TrackStampUnknown", "cam0/tracks.csv", "1000000000,1,2,3\n1000000001,1,2,3\n",
   {"cam0/tracks.csv:2:", "1000000001 is not the stamp of a frame", "expected one of cam0/data.csv"}},
  {"TrackIdNotWhole", "cam0/tracks.csv", "1000000000,1.5,2,3\n", {"cam0/tracks.csv:1:", "track_id", "'1.5'", "expected an integer"}},
  {"TrackIdRepeats", "cam0/tracks.csv", "1000000000,1,2,3\n1000000000,1,2,4\n", {"cam0/tracks.csv:2:", "track_id 1 repeats", "expected it once"}},
  {"TrackOffThePicture", "cam0/tracks.csv", "1000000000,1,20,480\n", {"cam0/tracks.csv:1:", "(20, 480)", "expected it within 64 x 48"}},
  {"TrackColumns", "cam0/tracks.csv", "1000000000,1,20\n", {"cam0/tracks.csv:1:", "has 3 columns", "expected 4 (timestamp [ns],track_id"}},
  {"TracksWithoutResolution", "cam0/sensor.yaml", "rate_hz: 30\n",
   {"cam0/tracks.csv:", "expected `resolution: [width, height]`", "cam0/sensor.yaml"}},
  {"NothingToSee", "cam0/tracks.csv", kRemoved, {"cam0:", "nothing to calibrate with", "video.mp4, tracks.csv"}},
  {"MatchOrder", "cam0/matches.csv", "#a,b,u,v,u,v\n1033000000,1000000000,1,2,3,4\n",
   {"cam0/matches.csv:2:", "1033000000 is not before timestamp_b 1000000000", "expected a < b"}},
  {"MatchStampUnknown", "cam0/matches.csv", "1000000000,1000000009,1,2,3,4\n", {"cam0/matches.csv:1:", "1000000009 is not the stamp"}},
  {"AttitudeNorm", "cam0/attitude.csv", "1000000000,1,0,0,0\n1033000000,1,0.1,0,0\n",
   {"cam0/attitude.csv:2:", "norm is 1.00499", "expected 1 within 0.001"}},
  {"AttitudeZero", "cam0/attitude.csv", "1000000000,0,0,0,0\n", {"cam0/attitude.csv:1:", "norm is 0", "expected 1"}},
  {"AttitudeMissing", "cam0/attitude.csv", "1000000000,1,0,0,0\n1066000000,1,0,0,0\n",
   {"cam0/attitude.csv:", "1033000000 has no attitude", "expected one row for every frame"}},
  {"AttitudeRepeats", "cam0/attitude.csv", "1000000000,1,0,0,0\n1000000000,0,1,0,0\n",
   {"cam0/attitude.csv:2:", "1000000000 repeats with another attitude"}},

  {"YamlBroken", "cam0/sensor.yaml", "resolution: [64, 48]\nintrinsics: [1, 2\nrate_hz: 30\n", {"cam0/sensor.yaml:", "not valid YAML"}},
  {"YamlNotAMap", "cam0/sensor.yaml", "- 1\n- 2\n", {"cam0/sensor.yaml:1:", "expected lines of `key: value`"}},
  {"YamlResolutionWord", "cam0/sensor.yaml", "rate_hz: 30\nresolution: [64, high]\n",
   {"cam0/sensor.yaml:2:", "resolution", "expected [width, height]"}},
  {"YamlResolutionOne", "cam0/sensor.yaml", "resolution: [64]\n", {"cam0/sensor.yaml:1:", "resolution", "expected [width, height]"}},
  {"YamlResolutionScalar", "cam0/sensor.yaml", "resolution: 64x48\n", {"cam0/sensor.yaml:1:", "resolution", "expected [width, height]"}},
  {"YamlIntrinsics", "cam0/sensor.yaml", "resolution: [64, 48]\nintrinsics: [50, -50, 32, 24]\n",
   {"cam0/sensor.yaml:2:", "intrinsics", "above zero"}},
  {"YamlIntrinsicsNan", "cam0/sensor.yaml", "resolution: [64, 48]\nintrinsics: [50, .nan, 32, 24]\n",
   {"cam0/sensor.yaml:2:", "intrinsics", "expected [fu, fv, cu, cv]"}},
  {"YamlCameraModel", "cam0/sensor.yaml", "resolution: [64, 48]\ncamera_model: omni\n",
   {"cam0/sensor.yaml:2:", "camera_model", "'omni'", "expected pinhole"}},
  {"YamlDistortionModel", "cam0/sensor.yaml", "resolution: [64, 48]\ndistortion_model: omni\ndistortion_coefficients: [0, 0, 0, 0]\n",
   {"cam0/sensor.yaml:2:", "distortion_model", "'omni' is not supported", "expected none, radial-tangential"}},
  {"YamlDistortionCount", "cam0/sensor.yaml", "resolution: [64, 48]\ndistortion_model: radtan\ndistortion_coefficients: [0.1]\n",
   {"cam0/sensor.yaml:3:", "expected distortion_coefficients: [k1, k2, p1, p2]"}},
  {"YamlDistortionWithoutModel", "cam0/sensor.yaml", "resolution: [64, 48]\ndistortion_coefficients: [0.1, 0, 0, 0]\n",
   {"cam0/sensor.yaml:2:", "distortion_model is missing", "expected it to be"}},
  {"YamlMounting", "cam0/sensor.yaml", "resolution: [64, 48]\nT_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]\n",
   {"cam0/sensor.yaml:", "T_BS", "is not a rotation", "expected an orthonormal"}},
  {"YamlMountingMirrored", "cam0/sensor.yaml", "resolution: [64, 48]\nT_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]\n",
   {"cam0/sensor.yaml:", "T_BS", "is not a rotation", "right-handed"}},
  {"YamlMountingCount", "cam0/sensor.yaml", "resolution: [64, 48]\nT_BS:\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n",
   {"cam0/sensor.yaml:", "T_BS", "9 numbers", "expected a map with `data`, the 16 numbers"}},
  {"YamlReadoutInMilliseconds", "cam0/sensor.yaml", "resolution: [64, 48]\nreadout_time: 25\n",
   {"cam0/sensor.yaml:2:", "readout_time", "25 s", "expected seconds"}},
  {"YamlShift", "cam0/sensor.yaml", "resolution: [64, 48]\ntimeshift_cam_imu: [0.01]\n",
   {"cam0/sensor.yaml:2:", "timeshift_cam_imu", "expected a finite number"}},
  {"VideoBroken", "cam0/video.mp4", "this is not a video", {"cam0/video.mp4:", "cannot be read as a video"}},
};
// clang-format on

class MalformedFolder : public ::testing::TestWithParam<Malformed> {};

TEST_P(MalformedFolder, IsRefusedWithFileLineAndExpectation) {
  const Malformed& malformed = GetParam();
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  ASSERT_TRUE(ReadRecording(folder.path()));  // sound before the change
  std::filesystem::create_directories(folder.File("cam0/data"));
  ASSERT_TRUE(cv::imwrite(folder.File("cam0/data/a.png"), cv::Mat(48, 64, CV_8UC1, cv::Scalar(0))));

  if (malformed.content == kRemoved) {
    folder.Remove(malformed.file);
  } else {
    folder.Write(malformed.file, malformed.content);
  }
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
  for (const char* part : malformed.complaint) {
    EXPECT_THAT(recording.error().message, HasSubstr(part));
  }
}

INSTANTIATE_TEST_SUITE_P(All, MalformedFolder, ::testing::ValuesIn(kMalformed),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(MalformedRecording, OtherSizeThanDeclared) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Write("cam0/data.csv", "1000000000,a.png\n1033000000,a.png\n1066000000,a.png\n");
  std::filesystem::create_directories(folder.File("cam0/data"));
  ASSERT_TRUE(cv::imwrite(folder.File("cam0/data/a.png"), cv::Mat(24, 32, CV_8UC1, cv::Scalar(0))));
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_FALSE(recording);
  EXPECT_THAT(recording.error().message, HasSubstr("a.png: the picture has 32 x 24 pixels"));
  EXPECT_THAT(recording.error().message, HasSubstr("sensor.yaml says resolution [64, 48]"));
}

// A folder or a pipe in the place of any file.
TEST(MalformedRecording, FilesThatAreNone) {
  for (const char* file : {"imu0/data.csv", "cam0/data.csv", "cam0/tracks.csv", "cam0/sensor.yaml",
                           "imu0/sensor.yaml", "cam0/data/a.png", "cam0/video.mp4"}) {
    SCOPED_TRACE(file);
    const RecordingFolder folder;
    folder.Write(TrackRecording());
    if (std::string(file).find("data/") != std::string::npos) {
      folder.Write("cam0/data.csv", "1000000000,a.png\n1033000000,a.png\n");
    }
    folder.Remove(file);
    std::filesystem::create_directories(folder.File(file));
    const Result<Recording> in_a_folder = ReadRecording(folder.path());
    EXPECT_FALSE(in_a_folder);
    EXPECT_EQ(in_a_folder.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(in_a_folder.error().message, HasSubstr(file));

    folder.Remove(file);
    ASSERT_EQ(mkfifo(folder.File(file).c_str(), 0600), 0);
    const Result<Recording> in_a_pipe = ReadRecording(folder.path());
    EXPECT_FALSE(in_a_pipe);
    EXPECT_THAT(in_a_pipe.error().message, HasSubstr(file));
  }
}

TEST(MalformedRecording, ImageThatIsNone) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Write("cam0/data.csv", "1000000000,a.png\n1033000000,a.png\n1066000000,a.png\n");
  folder.Write("cam0/data/a.png", "not a picture");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_FALSE(recording);
  EXPECT_THAT(recording.error().message,
              HasSubstr("a.png: cannot be decoded, expected a whole image"));
}

TEST(MalformedRecording, PathsThatAreNoRecording) {
  const RecordingFolder folder;
  folder.Write({{"other/readme.txt", "hello"},
                {"video.mp4", std::string("\0\0\0\x10"
                                          "ftypmp42",
                                          12)},
                {"half/imu0/data.csv", ""}});
  const std::pair<std::string, std::string> cases[] = {
      {folder.File("nowhere"), "does not exist"},
      {folder.File("other"), "not a recording of a known format"},
      {folder.File("other/readme.txt"), "which are EuRoC/ASL folder (a folder with cam0/"},
      {folder.File("video.mp4"), "cannot be read as a video"},
      {folder.File("half"), "has no folder cam0/; expected a recording with cam0/ and imu0/"}};
  for (const auto& [path, complaint] : cases) {
    const Result<Recording> recording = ReadRecording(path);
    ASSERT_FALSE(recording);
    EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(recording.error().message, HasSubstr(path + ":"));
    EXPECT_THAT(recording.error().message, HasSubstr(complaint));
  }
}

}  // namespace
}  // namespace camgyro
