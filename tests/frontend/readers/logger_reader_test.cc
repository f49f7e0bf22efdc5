// Recordings as phones and Gyroflow write them: read right, and refused where they are not whole.
#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/logger_folder.h"
#include "tests/frontend/readers/sound_logs.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(GcsvReader, ScalesAndTurns) {
  const LoggerFolder folder;
  folder.Write(In("log", kGcsv));
  folder.WriteVideo("a.mp4");
  for (const char* named : {"a.gcsv", "a.mp4"}) {
    const Result<Recording> recording = ReadRecording(folder.File(named));
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_THAT(Stamps(*recording), ElementsAre(0, 40000000, 80000000));
    ASSERT_EQ(recording->gyro.size(), 3u);
    EXPECT_EQ(recording->gyro[1].stamp_ns, 5000000);
    // YxZ: (y, -x, z), times gscale.
    EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(1.0, 0.5, 1.5));
    // ascale gives g: 1 g is 9.80665 m/s^2.
    EXPECT_LT((recording->accel[0].accel_gyro_m_s2 - Eigen::Vector3d(0, -9.80665, 0)).norm(),
              1e-12);
    EXPECT_DOUBLE_EQ(*recording->camera.readout_s, -0.0155);  // bottom to top
    EXPECT_FALSE(recording->camera.q_gyro_cam);
    EXPECT_THAT(recording->notes, Contains(HasSubstr("gyro axes YxZ")));
    ExpectPictures(*recording);
  }
}

TEST(GcsvReader, FindsTheVideoByItsName) {
  const LoggerFolder folder;
  Files files = kGcsv;
  files["a.gcsv"].replace(files["a.gcsv"].find("note,"), 5, "videofilename,clip.mov\nnote,");
  folder.Write(In("log", files));
  folder.WriteVideo("clip.mov");
  const Result<Recording> recording = ReadRecording(folder.File("a.gcsv"));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->video_file, folder.File("clip.mov"));
}

// A name that leads out of the folder is not followed: it is of the machine that wrote the log.
TEST(GcsvReader, FindsTheVideoInItsFolderOnly) {
  const LoggerFolder folder;
  folder.WriteVideo("../outside.mov");
  folder.WriteVideo("a.mp4");
  for (const std::string& name : {std::string("../outside.mov"), folder.File("../outside.mov")}) {
    Files files = kGcsv;
    files["a.gcsv"].replace(files["a.gcsv"].find("note,"), 5, "videofilename," + name + "\nnote,");
    folder.Write(In("log", files));
    const Result<Recording> recording = ReadRecording(folder.File("a.gcsv"));
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->video_file, folder.File("a.mp4"));
  }
}

// Microseconds that are integers stay exact.
TEST(GcsvReader, TimesAreExact) {
  const LoggerFolder folder;
  folder.Write(
      {{"log/a.gcsv",
        "CAMERA IMU LOG\r\nversion,1.0\r\nid,x\r\norientation,XYZ\r\ntscale,0.000001\r\n"
        "gscale,1\r\nt,gx,gy,gz\r\n9007199254740993,0,0,0\r\n9007199254745993,0,0,1\r\n"}});
  folder.WriteVideo("a.mp4");
  const Result<Recording> recording = ReadRecording(folder.File("a.gcsv"));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->gyro[0].stamp_ns, 9007199254740993000);  // 2^53 + 1 us
  EXPECT_EQ(recording->gyro[1].stamp_ns, 9007199254745993000);
}

TEST(MarsLoggerReader, Android) {
  const LoggerFolder folder;
  folder.Write(In("log", kMars));
  folder.WriteVideo("movie.mp4");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(Stamps(*recording), ElementsAre(1000000000, 1033333000, 1066666000));
  EXPECT_TRUE(std::isnan(recording->frames[0].exposure_s));
  EXPECT_DOUBLE_EQ(recording->frames[1].exposure_s, 0.005);
  EXPECT_DOUBLE_EQ(recording->frames[2].exposure_s, 0.006);
  EXPECT_DOUBLE_EQ(*recording->camera.focal_px, 502.0);
  EXPECT_DOUBLE_EQ(*recording->camera.readout_s, 0.02);
  ASSERT_EQ(recording->gyro.size(), 2u);
  EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(0.4, 0.2, 0.3));
  EXPECT_EQ(recording->accel[1].accel_gyro_m_s2, Eigen::Vector3d(0, 0, 9.8));
  ExpectPictures(*recording);
}

// iOS: seconds, a line about the start, and as many captures as pictures.
TEST(MarsLoggerReader, Ios) {
  const LoggerFolder folder;
  folder.Write({{"log/gyro_accel.csv",
                 "#Recording starts at Mon_01\nTimestamp[sec], gx[rad/s], gy[rad/s], gz[rad/s], "
                 "ax[m/s^2], ay[m/s^2], az[m/s^2]\n10.5000001, 0.1, 0.2, 0.3, 0, 0, 9.8\n"
                 "10.5100000, 0.1, 0.2, 0.4, 0, 0, 9.8\n"},
                {"log/movie_metadata.csv",
                 "Timestamp[sec],fx[px],fy[px],cx[px],cy[px],exposure time[nanosec]\n"
                 "10.5,500,500,32,24,1000000\n10.54,500,500,32,24,1000000\n"
                 "10.58,500,500,32,24,2000000\n"}});
  folder.WriteVideo("movie.MP4");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->gyro[0].stamp_ns, 10500000100);
  EXPECT_THAT(Stamps(*recording), ElementsAre(10500000000, 10540000000, 10580000000));
  EXPECT_DOUBLE_EQ(recording->frames[2].exposure_s, 0.002);
  EXPECT_FALSE(recording->camera.readout_s);
}

TEST(OpenCameraReader, TakesTheVideoBesideTheFolder) {
  const LoggerFolder folder;
  folder.Write(In("log", kOpenCamera));
  folder.WriteVideo("../VID_1.mp4");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(Stamps(*recording), ElementsAre(1000000000, 1040000000, 1080000000));
  EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(0.4, 0.2, 0.3));
  ASSERT_EQ(recording->accel.size(), 3u);
  EXPECT_EQ(recording->accel[1].stamp_ns, 1004000000);
  ExpectPictures(*recording);
}

TEST(SensorLoggerReader, VideoFromTheTimeInItsName) {
  const LoggerFolder folder;
  folder.Write(In("log", kSensorLogger));
  folder.WriteVideo("Camera/1698501144400.mp4");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(Stamps(*recording),
              ElementsAre(1698501144400000000, 1698501144440000000, 1698501144480000000));
  // By name, whatever the order; the uncalibrated log if there is one.
  EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(0.4, 0.5, 0.6));
  EXPECT_EQ(recording->accel[1].accel_gyro_m_s2, Eigen::Vector3d(2, 0, 9.8));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("tenths of a second")));
  ExpectPictures(*recording);
}

TEST(SensorLoggerReader, Images) {
  const LoggerFolder folder;
  folder.Write(In("log", kSensorLogger));
  std::filesystem::create_directories(folder.File("Camera"));
  for (const char* name : {"1698501144500.jpg", "1698501144400.jpg"}) {
    ASSERT_TRUE(cv::imwrite(folder.File(std::string("Camera/") + name),
                            cv::Mat(48, 64, CV_8UC1, cv::Scalar(9))));
  }
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(Stamps(*recording), ElementsAre(1698501144400000000, 1698501144500000000));
  ExpectPictures(*recording);
}

// A folder that is ours is read as ours, whatever else lies in it.
TEST(ReadRecording, OursComesFirst) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Write(kSensorLogger);
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->gyro.size(), 4u);
}

struct BrokenLog {
  const char* name;
  const Files& files;
  const char* video;  // relative to the folder
  const char* recording;
  const char* file;                                       // in which
  std::vector<std::pair<const char*, const char*>> edit;  // the first is replaced by the second
  std::vector<const char*> complaint;
};

// clang-format off
const BrokenLog kBroken[] = {
  {"GcsvCutShortInARow", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"10,1,2,3,0,0,4\n", "10,1,2"}},
   {"a.gcsv:14: this row has 3 columns, expected 7 (t,gx,gy,gz,ax,ay,az)"}},
  {"GcsvCutShortInTheHead", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"t,gx,gy,gz,ax,ay,az\n0,1,2,3,4,0,0\n5,-1,2,3,0,4,0\n10,1,2,3,0,0,4\n", ""}},
   {"a.gcsv: ends after 10 lines, expected a table with the header t,gx,gy,gz"}},
  {"GcsvOneSample", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"5,-1,2,3,0,4,0\n10,1,2,3,0,0,4\n", ""}}, {"a.gcsv: has 1 samples"}},
  {"GcsvWord", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"5,-1,2", "5,fast,2"}}, {"a.gcsv:13: column 2, gx: 'fast' was found, expected a finite number"}},
  {"GcsvNoGyro", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"t,gx,gy,gz", "t,gx,wy,gz"}}, {"a.gcsv: the header is t,gx,wy,gz,ax,ay,az, expected a column gy"}},
  {"GcsvNoScale", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"gscale,0.5\n", ""}}, {"a.gcsv: has no line gscale,NUMBER before its table"}},
  {"GcsvZeroScale", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"tscale,0.001", "tscale,0"}}, {"a.gcsv:8: tscale: '0' was found, expected a number above zero"}},
  {"GcsvDegrees", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"gscale,0.5", "gscale,50"}}, {"a.gcsv: angular rates reach", "looks like deg/s"}},
  {"GcsvTimeInSeconds", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"tscale,0.001", "tscale,0.000000001"}}, {"a.gcsv: the mean interval of its stamps is 5 ns"}},
  {"GcsvOrientation", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"orientation,YxZ", "orientation,YyZ"}}, {"a.gcsv:4: orientation: 'YyZ' was found, expected the letters x, y, z"}},
  {"GcsvOrientationLetter", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"orientation,YxZ", "orientation,ABC"}}, {"a.gcsv:4: orientation: 'ABC'"}},
  {"GcsvMagic", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"GYROFLOW", "OTHER"}}, {"a.gcsv:1: 'OTHER IMU LOG' was found, expected GYROFLOW IMU LOG"}},
  {"GcsvReadout", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"frame_readout_time,15.5", "frame_readout_time,fast"}}, {"a.gcsv:6: frame_readout_time: 'fast'"}},
  {"GcsvGoesBack", kGcsv, "a.mp4", "a.gcsv", "a.gcsv", {{"10,1,2,3", "4,1,2,3"}}, {"a.gcsv:14: timestamp 4000000 goes back, after 5000000"}},
  {"GcsvNoVideo", kGcsv, "b.mp4", "a.gcsv", "a.gcsv", {}, {"a.gcsv: no video beside it, expected", "a.mp4"}},

  {"MarsCutShort", kMars, "movie.mp4", "", "gyro_accel.csv", {{"0.4,0.2,0.3,0,0,9.8,1600000000005000000\n", "0.4,0.2"}},
   {"gyro_accel.csv:3: this row has 3 columns, expected 8 (Timestamp[nanosec],gx[rad/s]"}},
  {"MarsEmptyCell", kMars, "movie.mp4", "", "gyro_accel.csv", {{"0.4,0.2", "0.4,"}}, {"gyro_accel.csv:3: column 3, gy[rad/s]: the cell is empty"}},
  {"MarsUnit", kMars, "movie.mp4", "", "gyro_accel.csv", {{"gx[rad/s]", "gx[deg/s]"}}, {"gyro_accel.csv: the header is", "expected a column gx[rad/s]"}},
  {"MarsTimeUnit", kMars, "movie.mp4", "", "gyro_accel.csv", {{"Timestamp[nanosec]", "Timestamp[ms]"}}, {"gyro_accel.csv: the header is", "expected a column Timestamp[nanosec]"}},
  {"MarsNoGyro", kMars, "movie.mp4", "", "gyro_accel.csv", {{"Timestamp[nanosec],gx[rad/s],gy[rad/s],gz[rad/s],ax[m/s^2],ay[m/s^2],az[m/s^2],Unix time[nanosec]\n1000000000,0.1,0.2,0.3,0,0,9.8,1600000000000000000\n1005000000,0.4,0.2,0.3,0,0,9.8,1600000000005000000\n",
    "The device may not have a gyroscope!\n"}}, {"gyro_accel.csv: the header is The device may not have a gyroscope!"}},
  {"MarsEmpty", kMars, "movie.mp4", "", "frame_timestamps.txt", {{"Frame timestamp[nanosec]\n1000000000\n1033333000\n1066666000\n", ""}}, {"frame_timestamps.txt: expected a header of column names"}},
  {"MarsFrameRepeats", kMars, "movie.mp4", "", "frame_timestamps.txt", {{"1066666000", "1033333000"}}, {"frame_timestamps.txt:4: timestamp 1033333000 repeats"}},
  {"MarsFrameMissing", kMars, "movie.mp4", "", "frame_timestamps.txt", {{"1066666000\n", ""}}, {"frame_timestamps.txt: has 2 frames, but", "movie.mp4 has 3"}},
  {"MarsMetadataWord", kMars, "movie.mp4", "", "movie_metadata.csv", {{"5000000,33333333", "long,33333333"}}, {"movie_metadata.csv:3: column 5, Exposure time[nanosec]: 'long'"}},
  {"MarsNoVideo", kMars, "clip.mp4", "", "gyro_accel.csv", {}, {"has gyro_accel.csv of MARSLogger, but no movie.mp4"}},

  {"OpenCameraCutShort", kOpenCamera, "VID_1.mp4", "", "VID_1_gyro.csv", {{"0.3,1005000000\n", "0.3"}}, {"VID_1_gyro.csv:2: this row has 3 columns, expected 4 (x [rad/s],y [rad/s]"}},
  {"OpenCameraDegrees", kOpenCamera, "VID_1.mp4", "", "VID_1_gyro.csv", {{"0.1,0.2", "100,200"}, {"0.4,0.2", "100,200"}}, {"VID_1_gyro.csv: angular rates reach", "looks like deg/s"}},
  {"OpenCameraStamp", kOpenCamera, "VID_1.mp4", "", "VID_1_accel.csv", {{"1004000000", "1004000000.5"}}, {"VID_1_accel.csv:2: column 4, timestamp [ns]: '1004000000.5' was found, expected an integer"}},
  {"OpenCameraFrames", kOpenCamera, "VID_1.mp4", "", "VID_1_timestamps.csv", {{"1080000000\n", ""}}, {"VID_1_timestamps.csv: has 2 frames, but", "VID_1.mp4 has 3"}},
  {"OpenCameraNoVideo", kOpenCamera, "VID_2.mp4", "", "VID_1_gyro.csv", {}, {"has logs of OpenCamera Sensors, but no VID_1.mp4"}},

  {"SensorLoggerCutShort", kSensorLogger, "Camera/1698501144400.mp4", "", "GyroscopeUncalibrated.csv", {{"0.6,0.5,0.4\n", "0.6"}},
   {"GyroscopeUncalibrated.csv:3: this row has 3 columns, expected 5 (time,seconds_elapsed,z,y,x)"}},
  {"SensorLoggerColumn", kSensorLogger, "Camera/1698501144400.mp4", "", "TotalAcceleration.csv", {{"z,y,x", "z,y"}}, {"TotalAcceleration.csv: the header is time,seconds_elapsed,z,y, expected a column x"}},
  {"SensorLoggerMilliseconds", kSensorLogger, "Camera/1698501144400.mp4", "", "GyroscopeUncalibrated.csv",
   {{"1698501144401773000", "1698501144401"}, {"1698501144411773000", "1698501144411"}}, {"GyroscopeUncalibrated.csv: the mean interval of its stamps is 10 ns"}},
  {"SensorLoggerNoCamera", kSensorLogger, "clip.mp4", "", "Gyroscope.csv", {}, {"Camera: has 0 images and 0 videos"}},
};
// clang-format on

class BrokenLogger : public ::testing::TestWithParam<BrokenLog> {};

TEST_P(BrokenLogger, IsRefusedWithFileLineAndExpectation) {
  const BrokenLog& broken = GetParam();
  const LoggerFolder folder;
  Files files = broken.files;
  for (const auto& [before, after] : broken.edit) {
    std::string& text = files[broken.file];
    const size_t at = text.find(before);
    ASSERT_NE(at, std::string::npos) << before;
    text.replace(at, std::string(before).size(), after);
  }
  folder.Write(In("log", files));
  folder.WriteVideo(broken.video);
  const Result<Recording> recording = ReadRecording(folder.File(broken.recording));
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
  for (const char* part : broken.complaint) {
    EXPECT_THAT(recording.error().message, HasSubstr(part));
  }
}

INSTANTIATE_TEST_SUITE_P(All, BrokenLogger, ::testing::ValuesIn(kBroken),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace camgyro
