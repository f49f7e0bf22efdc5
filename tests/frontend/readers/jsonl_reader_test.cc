// Recordings with one JSON object per line.
#include <gmock/gmock.h>

#include <string>

#include "tests/frontend/readers/logger_folder.h"
#include "tests/frontend/readers/sound_logs.h"

namespace camgyro {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(JsonlReader, PicturesAndSamples) {
  for (const char* video : {"data.mp4", "data.mov"}) {
    const LoggerFolder folder;
    folder.Write(In("log", kJsonl));
    folder.WriteVideo(video);
    const Result<Recording> recording = ReadRecording(folder.path());
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_THAT(Stamps(*recording), ElementsAre(10500000000, 10540000000, 10580000000));
    EXPECT_EQ(recording->frames[0].exposure_s, 0.005);
    ASSERT_EQ(recording->gyro.size(), 2u);
    EXPECT_EQ(recording->gyro[1].stamp_ns, 10505000000);
    EXPECT_EQ(recording->gyro[1].omega_gyro_rad_s, Eigen::Vector3d(0.25, 0.25, 0.5));
    ASSERT_EQ(recording->accel.size(), 1u);
    EXPECT_EQ(recording->accel[0].accel_gyro_m_s2, Eigen::Vector3d(0, 0, 9.75));
    EXPECT_EQ(recording->camera.focal_px, 40.0);
    EXPECT_EQ(recording->camera.aspect_ratio, 1.25);
    EXPECT_EQ(recording->camera.principal_px, Eigen::Vector2d(31.5, 23.5));
    ExpectPictures(*recording);
  }
}

TEST(JsonlReader, WhatIsNotWholeIsRefused) {
  const LoggerFolder folder;
  folder.Write(In("log", kJsonl));
  folder.WriteVideo("data.mp4");
  ExpectComplaints(
      folder, kJsonl,
      {{"data.jsonl", "10.505}", "10.505", "data.jsonl:5: is no JSON object; the file may be cut"},
       {"data.jsonl", "[0.25,0.25,0.5]", "[0.25,0.25]", "data.jsonl:5: expected \"values\": three"},
       {"data.jsonl", "[0.25,0.25,0.5]", "[1,2,\"3\"]", "data.jsonl:5: expected \"values\": three"},
       {"data.jsonl", "[0.25,0.25,0.5]", "[1,2,1e999]", "data.jsonl:5: is no JSON object"},
       {"data.jsonl", "\"time\":10.505", "\"time\":1e300",
        "data.jsonl:5: expected \"time\": a number"},
       {"data.jsonl", "\"time\":10.54", "\"when\":10.54",
        "data.jsonl:7: expected \"time\": a number"},
       {"data.jsonl", "10.58", "10.53", "data.jsonl:9: timestamp 10530000000 goes back"},
       {"data.jsonl", "[{\"cameraInd\":0}],\"time\":10.58", "[]",
        "data.jsonl: has 2 frames, but"}});
  folder.Remove("data.mp4");
  const Result<Recording> nothing = ReadRecording(folder.path());
  ASSERT_FALSE(nothing);
  EXPECT_THAT(nothing.error().message, HasSubstr("has data.jsonl, but no data.mp4"));
}

TEST(JsonlReader, DamageIsSurvived) {
  const LoggerFolder folder;
  folder.Write(In("log", kJsonl));
  folder.WriteVideo("data.mp4");
  ExpectSurvivesDamage(folder, "", kJsonl);
}

}  // namespace
}  // namespace camgyro
