#include "core/recording_csv.h"

#include <gmock/gmock.h>

#include <sstream>

namespace camgyro {
namespace {

TEST(RecordingCsv, FramesHaveNamesWithoutFoldersAndExposuresWhereKnown) {
  std::vector<Frame> frames(2);
  frames[0].stamp_ns = 5;
  frames[0].image_file = "/somewhere/a.png";
  frames[0].exposure_s = 0.004;
  frames[1].stamp_ns = 1700000000123456789;
  frames[1].image_file = "b.png";
  EXPECT_EQ(FramesCsv(frames),
            "#timestamp [ns],filename,exposure [s]\n5,a.png,0.004000000\n"
            "1700000000123456789,b.png,\n");
}

TEST(RecordingCsv, TracksAreRoundedAsAskedFor) {
  Recording recording;
  recording.frames.resize(2);
  recording.frames[1].stamp_ns = 7;
  recording.tracks = {{{3, {1.23456, 2.0}}}, {{3, {-0.5, 4.00006}}, {4, {0.0, 1.0}}}};
  std::ostringstream csv;
  WriteTracksCsv(recording, 4, &csv);
  EXPECT_EQ(csv.str(),
            "#timestamp [ns],track_id,u [px],v [px]\n0,3,1.2346,2.0000\n7,3,-0.5000,4.0001\n"
            "7,4,0.0000,1.0000\n");
}

TEST(RecordingCsv, TheAccelerometerIsInterpolatedAtTheGyrosStamps) {
  Recording recording;
  for (int i = 0; i < 4; ++i) recording.gyro.push_back({10 * i, {0.5 * i, 0.0, -1.0}});
  EXPECT_EQ(ImuCsv(recording),
            "#timestamp [ns],w_x [rad s^-1],w_y [rad s^-1],w_z [rad s^-1]\n0,0,0,-1\n10,0.5,0,-1\n"
            "20,1,0,-1\n30,1.5,0,-1\n");
  // Before the first of its samples nothing is known of the accelerometer.
  recording.accel = {{5, {1.0, 0.0, 9.0}}, {20, {4.0, 0.0, 9.0}}, {40, {6.0, 0.0, 9.0}}};
  EXPECT_EQ(ImuCsv(recording),
            "#timestamp [ns],w_x [rad s^-1],w_y [rad s^-1],w_z [rad s^-1],a_x [m s^-2],"
            "a_y [m s^-2],a_z [m s^-2]\n10,0.5,0,-1,2,0,9\n20,1,0,-1,4,0,9\n30,1.5,0,-1,5,0,9\n");
}

}  // namespace
}  // namespace camgyro
