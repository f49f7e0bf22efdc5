// Stray Scanner and ios_logger, the two apps for iPhones with Apple's conventions.
#include <gmock/gmock.h>

#include <string>

#include "tests/frontend/readers/logger_folder.h"
#include "tests/frontend/readers/sound_logs.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(StrayScannerReader, PicturesAndSamples) {
  const LoggerFolder folder;
  folder.Write(In("log", kStray));
  folder.WriteVideo("rgb.mp4");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(Stamps(*recording), ElementsAre(100500000000, 100540000000, 100580000000));
  ASSERT_EQ(recording->gyro.size(), 2u);
  EXPECT_EQ(recording->gyro[1].stamp_ns, 100510000000);
  EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(0.25, 0.25, 0.5));
  // Apple's acceleration points as gravity does; specific force points up.
  EXPECT_EQ(recording->accel[0].accel_gyro_m_s2, Eigen::Vector3d(-0.5, 9.75, 0));
  EXPECT_EQ(recording->camera.focal_px, 40.0);
  EXPECT_EQ(recording->camera.aspect_ratio, 1.25);
  EXPECT_EQ(recording->camera.principal_px, Eigen::Vector2d(31.5, 23.5));
  EXPECT_TRUE(recording->q_cam_world.empty());
  ExpectPictures(*recording);
}

TEST(StrayScannerReader, AttitudesServeWithoutVideo) {
  const LoggerFolder folder;
  Files files = kStray;
  files["imu.csv"] =
      "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n1, 0, -1, 0, 0, 0, 0\n"
      "1.01, 0, -1, 0, 0, 0, 1\n";
  folder.Write(In("log", files));
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_TRUE(recording->HasOnlyAttitudes());
  ASSERT_EQ(recording->q_cam_world.size(), 3u);
  EXPECT_TRUE(recording->q_cam_world[0].isApprox(Eigen::Quaterniond(0.8, -0.6, 0, 0)));
  EXPECT_EQ(recording->accel[0].accel_gyro_m_s2, Eigen::Vector3d(0, 9.80665, 0));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("accelerations taken to be in g")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("has no rgb.mp4")));
}

TEST(StrayScannerReader, WhatIsNotWholeIsRefused) {
  const LoggerFolder folder;
  folder.Write(In("log", kStray));
  folder.WriteVideo("rgb.mp4");
  ExpectComplaints(
      folder, kStray,
      {{"imu.csv", "alpha_y", "beta", "imu.csv: the header is timestamp,a_x"},
       {"imu.csv", "0.25, 0.25", "0.25, nan", "imu.csv:3: column 6, alpha_y: 'nan' was found"},
       {"odometry.csv", "0.6, 0, 0, 0.8", "0.6, 0, 0, 0.9",
        "odometry.csv:2: the quaternion's norm"},
       {"odometry.csv", "100.58, 000002, 0, 0, 0, 0, 0, 0, 1\n", "", "odometry.csv: has 2 frames"},
       {"odometry.csv", "100.58", "100.52", "odometry.csv:4: timestamp 100520000000 goes back"},
       {"camera_matrix.csv", "40.0", "0.0", "camera_matrix.csv: expected a 3 x 3 matrix"},
       {"camera_matrix.csv", "40.0, ", "", "camera_matrix.csv:2: this row has 2 columns"}});
}

TEST(StrayScannerReader, DamageIsSurvived) {
  const LoggerFolder folder;
  folder.Write(In("log", kStray));
  folder.WriteVideo("rgb.mp4");
  ExpectSurvivesDamage(folder, "", kStray);
}

TEST(IosLoggerReader, PicturesAndSamples) {
  const LoggerFolder folder;
  folder.Write(In("log", kIos));
  folder.WriteVideo("Frames.m4v");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 3u);
  // A stamp of this size has 256 ns as a number of double precision.
  EXPECT_NEAR(recording->frames[1].stamp_ns - 1600000000540000000, 0, 256);
  EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(0.25, 0.25, 0.5));
  EXPECT_EQ(recording->accel[0].accel_gyro_m_s2, Eigen::Vector3d(0, 9.80665, 0));
  EXPECT_EQ(recording->camera.focal_px, 502.0);
  EXPECT_EQ(recording->camera.principal_px, Eigen::Vector2d(320, 240));
  ExpectPictures(*recording);
}

TEST(IosLoggerReader, AttitudesServeWithoutVideo) {
  const LoggerFolder folder;
  folder.Write(In("log", kIos));
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 2u);
  EXPECT_TRUE(recording->HasOnlyAttitudes());
  EXPECT_TRUE(recording->q_cam_world[0].isApprox(Eigen::Quaterniond(0.8, -0.6, 0, 0)));
}

TEST(IosLoggerReader, WhatIsNotWholeIsRefused) {
  const LoggerFolder folder;
  folder.Write(In("log", kIos));
  folder.WriteVideo("Frames.m4v");
  ExpectComplaints(
      folder, kIos,
      {{"Gyro.txt", "0.25,0.25,0.5", "0.25", "Gyro.txt:2: this row has 2 columns, expected 4"},
       {"Accel.txt", "-1,0.5", "-1,x", "Accel.txt:2: column 4, z [g]: 'x' was found"},
       {"Frames.txt", "501,503", "501,0", "Frames.txt:2: expected focal lengths above zero"},
       {"Frames.txt", "1600000000.58,2,502,501,320,240\r\n", "", "Frames.txt: has 2 frames, but"}});
  folder.Remove("Frames.m4v");
  folder.Remove("ARposes.txt");
  const Result<Recording> nothing = ReadRecording(folder.path());
  ASSERT_FALSE(nothing);
  EXPECT_THAT(nothing.error().message, HasSubstr("has Gyro.txt of ios_logger, but neither"));
}

TEST(IosLoggerReader, DamageIsSurvived) {
  const LoggerFolder folder;
  folder.Write(In("log", kIos));
  folder.WriteVideo("Frames.m4v");
  ExpectSurvivesDamage(folder, "", kIos);
}

}  // namespace
}  // namespace camgyro
