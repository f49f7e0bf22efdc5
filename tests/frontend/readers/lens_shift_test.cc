// Where a stabilised lens was, in each of the formats that say so.
#include "frontend/readers/lens_shift.h"

#include <gmock/gmock.h>

#include <string>

#include "tests/frontend/readers/logger_folder.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/frontend/readers/sound_logs.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

// Beside the frames of TrackRecording(), at 1, 1.033 and 1.066 s.
Result<Recording> WithTable(const std::string& table) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Write("cam0/lens_shift.csv", table);
  return ReadRecording(folder.path());
}

TEST(LensShiftReader, PutsSamplesInOrderOnce) {
  const Result<Recording> recording = WithTable(
      "#timestamp [ns],shift_x [px],shift_y [px]\n"
      "1020000000,3,-4\n990000000,1,2\n1020000000,3,-4\n1060000000,0.5,0.25\n");
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->lens_shift.size(), 3u);
  EXPECT_EQ(recording->lens_shift[1].stamp_ns, 1020000000);
  EXPECT_EQ(recording->lens_shift[1].shift_px, Eigen::Vector2d(3.0, -4.0));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("shifts the picture by up to 5.0 px")));
}

TEST(LensShiftReader, LeavesOutWhatSaysNothing) {
  const Result<Recording> held = WithTable("1000000000,3,4\n1030000000,3,4\n1060000000,3,4\n");
  ASSERT_TRUE(held) << held.error().message;
  EXPECT_TRUE(held->lens_shift.empty());
  EXPECT_THAT(held->notes, Contains(HasSubstr("lens_shift.csv: the lens does not move")));
  const Result<Recording> elsewhere = WithTable("1000000000,3,4\n1002000000,4,4\n");
  ASSERT_TRUE(elsewhere) << elsewhere.error().message;
  EXPECT_TRUE(elsewhere->lens_shift.empty());
  EXPECT_THAT(elsewhere->notes, Contains(HasSubstr("for 1 of 3 pictures only; it is not used")));
}

TEST(LensShiftReader, RefusesWhatIsNoShift) {
  for (const auto& [table, message] : std::map<std::string, std::string>{
           {"1000000000,3,4\n", "lens_shift.csv: has 1 positions of the lens, expected two"},
           {"1000000000,3,4\n1030000000,x,4\n", "lens_shift.csv:2: column 2, shift_x [px]: 'x'"},
           {"1000000000,3,4\n1030000000,3\n", "lens_shift.csv:2"},
           {"1000000000,3,4\n1030000000,640,0\n", "stamp 1030000000: a shift of 640 px"}}) {
    const Result<Recording> recording = WithTable(table);
    ASSERT_FALSE(recording) << table;
    EXPECT_THAT(recording.error().message, HasSubstr(message));
  }
}

TEST(LensShiftReader, RecordingYamlSaysWhereItIs) {
  const LoggerFolder folder;
  Files files = kDescribed;
  files["recording.yaml"] +=
      "lens_shift: {file: ois.csv, time: t, time_unit: ms, time_offset_s: 100, columns: [y, 2],\n"
      "             px_per_unit: 0.5}\n";
  files["ois.csv"] = "t,x,y\n500,2,10\n540,3,-6\n580,3,8\n";
  folder.Write(In("log", files));
  folder.WriteVideo("clip.mp4");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->lens_shift.size(), 3u);
  EXPECT_EQ(recording->lens_shift[1].stamp_ns, 100540000000);
  EXPECT_EQ(recording->lens_shift[1].shift_px, Eigen::Vector2d(-3.0, 1.5));
  ExpectComplaints(
      folder, files,
      {{"recording.yaml", "columns: [y, 2]", "columns: [y]", "expected [x, y], two names"},
       {"recording.yaml", "columns: [y, 2]", "columns: [y, z]", "ois.csv: the header is t,x,y"},
       {"recording.yaml", "file: ois.csv, ", "", "file: is missing below `lens_shift`"},
       {"recording.yaml", "px_per_unit", "scale", "unknown key `scale`"},
       {"ois.csv", "-6", "x", "ois.csv:3: column 3, y: 'x' was found"}});
}

}  // namespace
}  // namespace camgyro
