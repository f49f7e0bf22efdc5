#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"

namespace camgyro {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<int64_t> Stamps(const std::vector<Frame>& frames) {
  std::vector<int64_t> stamps;
  for (const Frame& frame : frames) stamps.push_back(frame.stamp_ns);
  return stamps;
}

TEST(FolderReader, ReadsTracksGyroAndDeclarations) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;

  EXPECT_EQ(recording->path, folder.path());
  EXPECT_THAT(Stamps(recording->frames), ElementsAre(1000000000, 1033000000, 1066000000));
  EXPECT_TRUE(std::isnan(recording->frames[0].exposure_s));
  EXPECT_FALSE(recording->HasImages());
  ASSERT_EQ(recording->tracks.size(), 3u);
  ASSERT_EQ(recording->tracks[0].size(), 2u);
  EXPECT_EQ(recording->tracks[0][0].track_id, 3);  // ascending ids
  EXPECT_EQ(recording->tracks[0][1].track_id, 7);
  EXPECT_EQ(recording->tracks[0][1].px, Eigen::Vector2d(10.5, 20.25));
  EXPECT_EQ(recording->tracks[2].size(), 1u);

  ASSERT_EQ(recording->gyro.size(), 4u);
  EXPECT_EQ(recording->gyro[2].stamp_ns, 1030000000);
  EXPECT_EQ(recording->gyro[2].omega_gyro_rad_s, Eigen::Vector3d(-0.1, 0.2, 0.3));
  ASSERT_EQ(recording->accel.size(), 4u);
  EXPECT_EQ(recording->accel[0].accel_gyro_m_s2, Eigen::Vector3d(1, 2, 9));

  const CameraGuess& camera = recording->camera;
  EXPECT_EQ(camera.width_px, 64);
  EXPECT_EQ(camera.height_px, 48);
  EXPECT_DOUBLE_EQ(camera.focal_px.value(), 40.0);  // fv
  EXPECT_DOUBLE_EQ(camera.aspect_ratio, 1.25);      // fu / fv
  EXPECT_EQ(camera.principal_px.value(), Eigen::Vector2d(31.5, 23.5));
  EXPECT_EQ(camera.distortion_model, DistortionModel::kRadTan);
  EXPECT_THAT(camera.distortion, ElementsAre(-0.28, 0.07, 0.0002, 1.8e-05));
  EXPECT_DOUBLE_EQ(camera.readout_s.value(), 0.025);
  EXPECT_DOUBLE_EQ(camera.delay_s.value(), -0.004);
  // T_BS maps the camera's x axis to the body's y axis, and its y axis to the body's -x axis.
  const Eigen::Quaterniond q_gyro_cam = camera.q_gyro_cam.value();
  EXPECT_LT((q_gyro_cam * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_LT((q_gyro_cam * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(recording->gyro_info.noise_density_rad_s_rtHz.value(), 1.7e-4);
  EXPECT_DOUBLE_EQ(recording->gyro_info.random_walk_rad_s2_rtHz.value(), 1.9e-5);
  EXPECT_THAT(recording->notes, IsEmpty());
}

TEST(FolderReader, YamlIsOptionalForAttitudes) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Remove("cam0/sensor.yaml");
  folder.Remove("imu0/sensor.yaml");
  folder.Remove("cam0/tracks.csv");
  folder.Remove("cam0/data.csv");
  folder.Write("cam0/attitude.csv",
               "#timestamp [ns],q_cam_world_w,x,y,z\n"
               "1033000000,0.6,0.8,0,0\n1000000000,1.0005,0,0,0\n");  // any order of rows
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(Stamps(recording->frames), ElementsAre(1000000000, 1033000000));
  ASSERT_EQ(recording->q_cam_world.size(), 2u);
  EXPECT_DOUBLE_EQ(recording->q_cam_world[0].w(), 1.0);  // normalised
  EXPECT_DOUBLE_EQ(recording->q_cam_world[1].x(), 0.8);
  EXPECT_FALSE(recording->camera.focal_px);
  EXPECT_FALSE(recording->camera.q_gyro_cam);
  EXPECT_EQ(recording->camera.width_px, 0);
}

TEST(FolderReader, GroupsMatchesByPairOfFrames) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Remove("cam0/tracks.csv");
  folder.Write("cam0/matches.csv",
               "#timestamp_a [ns],timestamp_b [ns],u_a,v_a,u_b,v_b [px]\n"
               "1033000000,1066000000,1,2,3,4\n1000000000,1033000000,5,6,7,8\n"
               "1033000000,1066000000,9,10,11,12\n1000000000,1066000000,13,14,15,16\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->matches.size(), 3u);
  const FramePair& last = recording->matches[2];
  EXPECT_EQ(last.frame_a, 1);
  EXPECT_EQ(last.frame_b, 2);
  ASSERT_EQ(last.matches.size(), 2u);
  EXPECT_EQ(last.matches[1].px_a, Eigen::Vector2d(9, 10));
  EXPECT_EQ(last.matches[1].px_b, Eigen::Vector2d(11, 12));
  EXPECT_EQ(recording->matches[1].frame_b, 2);  // pairs in the order of their frames
}

TEST(FolderReader, ToleratesHowFilesAreWrittenInPractice) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  // mav0/, byte order mark, CRLF, header without '#', blanks, comments, empty lines, no last
  // newline, a repeated row, a plus sign.
  std::filesystem::create_directories(folder.File("mav0"));
  std::filesystem::rename(folder.File("cam0"), folder.File("mav0/cam0"));
  std::filesystem::rename(folder.File("imu0"), folder.File("mav0/imu0"));
  folder.Write("mav0/imu0/data.csv",
               "\xEF\xBB\xBFtimestamp,wx,wy,wz\r\n\r\n 1000000000 , 0.1,\t+0.2 ,0.3\r\n"
               "# lost contact here\r\n1010000000,0.1,0.2,0.3\r\n1010000000,0.1,0.2,0.3\r\n"
               "1020000000,-1e-3,.5,0\r\n\r\n  \r\n1030000000,0,0,0");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->gyro.size(), 4u);
  EXPECT_EQ(recording->gyro[0].omega_gyro_rad_s, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(recording->gyro[2].omega_gyro_rad_s, Eigen::Vector3d(-1e-3, 0.5, 0));
  EXPECT_THAT(recording->accel, IsEmpty());
  EXPECT_THAT(recording->notes,
              ElementsAre(HasSubstr("1 rows that repeat the one before were dropped")));
}

TEST(FolderReader, ConvertsDegreesThatTheHeaderDeclares) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Write("imu0/data.csv",
               "#timestamp [ns],w_x [deg s^-1],w_y [deg s^-1],w_z [deg s^-1]\n"
               "1000000000,180,-90,0\n1010000000,180,-90,0\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_NEAR(recording->gyro[0].omega_gyro_rad_s.x(), M_PI, 1e-12);
  EXPECT_NEAR(recording->gyro[0].omega_gyro_rad_s.y(), -M_PI / 2, 1e-12);
  EXPECT_THAT(recording->notes, ElementsAre(HasSubstr("deg/s to rad/s")));
}

TEST(FolderReader, OneWildSampleDoesNotMakeTheUnitWrong) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  std::string csv;
  for (int64_t i = 0; i < 500; ++i) {
    csv += std::to_string(1000000000 + i * 10000000) + (i == 100 ? ",99,0,0\n" : ",0.5,0,0\n");
  }
  folder.Write("imu0/data.csv", csv);
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->gyro[100].omega_gyro_rad_s.x(), 99.0);
}

TEST(FolderReader, NotesClocksThatDoNotOverlap) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Write("imu0/data.csv", "5000000000,0.1,0.2,0.3\n5010000000,0.1,0.2,0.3\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(recording->notes,
              ElementsAre(HasSubstr("camera and gyro clocks do not overlap: frames from "
                                    "1000000000 to 1066000000 ns, gyro from 5000000000")));
}

TEST(FolderReader, NotesARateThatTheStampsDoNotHave) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Write("imu0/sensor.yaml", "rate_hz: 200\n");  // stamps: 20 ms apart
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(recording->notes,
              ElementsAre(HasSubstr("imu0/sensor.yaml: says rate_hz 200, but the stamps of imu0 "
                                    "give 50 Hz")));
}

// Samples that are delivered eight at a time: the rate is theirs, not that within a packet.
TEST(FolderReader, NotesNoRateOfPackets) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  std::string rows;
  for (int64_t i = 0; i < 400; ++i) {
    const int64_t arrived_ns = 1'000'000'000 + 5'000'000 * (8 * (i / 8) + 7) + 1000 * (i % 8);
    rows += std::to_string(arrived_ns) + ",0.1,0.2,0.3\n";
  }
  folder.Write("imu0/data.csv", rows);
  folder.Write("imu0/sensor.yaml", "rate_hz: 200\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(recording->notes, ::testing::Not(::testing::Contains(HasSubstr("says rate_hz"))));
}

TEST(FolderReader, ComposesTheMountingOfCameraAndImu) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  // The IMU is turned as the camera is: seen from the IMU, the camera is not turned at all.
  folder.Write("imu0/sensor.yaml",
               "T_BS:\n  cols: 4\n  rows: 4\n"
               "  data: [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_LT(recording->camera.q_gyro_cam->angularDistance(Eigen::Quaterniond::Identity()), 1e-9);
}

// Images with a step whose place tells the frame.
cv::Mat Picture(int frame) {
  cv::Mat image(48, 64, CV_8UC1, cv::Scalar(40));
  image.colRange(0, 8 * (frame + 1)).setTo(200);
  return image;
}

void WriteImageRecording(const RecordingFolder& folder, const std::string& extension) {
  folder.Write(TrackRecording());
  folder.Remove("cam0/tracks.csv");
  std::string csv = "#timestamp [ns],filename,exposure [s]\n";
  std::filesystem::create_directories(folder.File("cam0/data"));
  for (int i = 0; i < 3; ++i) {
    const std::string name = std::to_string(i) + extension;
    ASSERT_TRUE(cv::imwrite(folder.File("cam0/data/" + name), Picture(i)));
    csv += std::to_string(1000000000 + i * 33000000) + "," + name + (i == 1 ? ",\n" : ",0.005\n");
  }
  folder.Write("cam0/data.csv", csv);
}

TEST(FolderReader, HandsOutImagesInOrder) {
  const RecordingFolder folder;
  WriteImageRecording(folder, ".png");
  folder.Remove("cam0/sensor.yaml");  // the images say how large they are
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->camera.width_px, 64);
  EXPECT_EQ(recording->camera.height_px, 48);
  EXPECT_DOUBLE_EQ(recording->frames[0].exposure_s, 0.005);
  EXPECT_TRUE(std::isnan(recording->frames[1].exposure_s));

  auto frames = OpenFrames(*recording);
  ASSERT_TRUE(frames) << frames.error().message;
  cv::Mat gray;
  for (int i = 0; i < 3; ++i) {
    const Result<bool> more = (*frames)->Next(&gray);
    ASSERT_TRUE(more) << more.error().message;
    ASSERT_TRUE(*more);
    EXPECT_EQ(cv::norm(gray, Picture(i), cv::NORM_INF), 0.0);
  }
  EXPECT_FALSE((*frames)->Next(&gray).value());
  EXPECT_FALSE((*frames)->Next(&gray).value());  // and stays at the end

  frames = OpenFrames(*recording);
  ASSERT_TRUE((*frames)->SkipTo(2));
  ASSERT_TRUE((*frames)->Next(&gray).value());
  EXPECT_EQ(cv::norm(gray, Picture(2), cv::NORM_INF), 0.0);
  ASSERT_TRUE((*frames)->SkipTo(100));  // beyond the end
  EXPECT_FALSE((*frames)->Next(&gray).value());
}

TEST(FolderReader, ImagesHaveColourPlanes) {
  const RecordingFolder folder;
  WriteImageRecording(folder, ".png");
  // Pure blue: Y, U, V of BT.601 video are 41, 240, 110.
  cv::imwrite(folder.File("cam0/data/1.png"), cv::Mat(48, 64, CV_8UC3, cv::Scalar(255, 0, 0)));
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  auto frames = OpenFrames(*recording, PictureFormat::kI420);
  ASSERT_TRUE(frames) << frames.error().message;
  cv::Mat i420;
  ASSERT_TRUE((*frames)->Next(&i420).value());
  ASSERT_EQ(i420.size(), cv::Size(64, 72));
  EXPECT_LE(cv::norm(i420.rowRange(48, 72) - 128, cv::NORM_INF), 1.0);  // grey
  ASSERT_TRUE((*frames)->Next(&i420).value());
  EXPECT_NEAR(i420.at<uint8_t>(20, 30), 41, 1);
  EXPECT_NEAR(i420.at<uint8_t>(48 + 3, 30), 240, 1);
  EXPECT_NEAR(i420.at<uint8_t>(60 + 3, 30), 110, 1);
}

TEST(FolderReader, NamesAnImageThatIsCutShort) {
  for (const std::string extension : {".png", ".jpg"}) {
    SCOPED_TRACE(extension);
    const RecordingFolder folder;
    WriteImageRecording(folder, extension);
    const std::string image = folder.File("cam0/data/1" + extension);
    std::filesystem::resize_file(image, std::filesystem::file_size(image) * 3 / 4);
    const Result<Recording> recording = ReadRecording(folder.path());
    ASSERT_TRUE(recording) << recording.error().message;
    auto frames = OpenFrames(*recording);
    ASSERT_TRUE(frames) << frames.error().message;
    cv::Mat gray;
    ASSERT_TRUE((*frames)->Next(&gray).value());
    const Result<bool> more = (*frames)->Next(&gray);
    ASSERT_FALSE(more);
    EXPECT_EQ(more.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(more.error().message, HasSubstr("data/1" + extension));
  }
}

TEST(FolderReader, NoPicturesIsAnErrorOfOpenFrames) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording);
  const auto frames = OpenFrames(*recording);
  ASSERT_FALSE(frames);
  EXPECT_THAT(frames.error().message, HasSubstr("has no pictures"));
}

}  // namespace
}  // namespace camgyro
