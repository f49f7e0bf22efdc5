#include "pipeline/frame_times_file.h"

#include <gmock/gmock.h>

#include <vector>

#include "pipeline/result_files.h"
#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class FrameTimesFileTest : public CamgyroTest {
 protected:
  FrameTimesFileTest() {
    recording_.gyro.resize(1);
    recording_.gyro[0].stamp_ns = 1'000;
    recording_.frames.resize(4);
    for (size_t i = 0; i < 4; ++i) {
      recording_.frames[i].stamp_ns = 2'000 + 100 * static_cast<int64_t>(i);
    }
  }
  std::vector<int64_t> Stamps() const {
    std::vector<int64_t> stamps;
    for (const Frame& frame : recording_.frames) stamps.push_back(frame.stamp_ns);
    return stamps;
  }
  Recording recording_;
};

// Offsets are named by the frame's stamp after the first gyro sample. The third frame is not
// listed; the last one is moved before it, which stamps must not be.
TEST_F(FrameTimesFileTest, GivesFramesTheTimesThatAFitHasWritten) {
  std::ofstream(Path("frame_times.csv")) << FrameTimesCsv(
      recording_, {{1'000, 20e-9, 3e-9}, {1'100, -30e-9, 3e-9}, {1'300, -150e-9, 3e-9}});
  ASSERT_TRUE(ApplyFrameTimes(Path("calibration.yaml"), &recording_));
  EXPECT_THAT(Stamps(), ElementsAre(2'020, 2'070, 2'200, 2'201));
  EXPECT_THAT(recording_.notes, ElementsAre(HasSubstr("3 of 4 frames have the times of")));
}

TEST_F(FrameTimesFileTest, GivesFramesTheTimesOfAFit) {
  ApplyFrameTimes({{1'000, 20e-9, 3e-9}, {1'100, -30e-9, 3e-9}, {1'300, -150e-9, 3e-9}},
                  &recording_);
  EXPECT_THAT(Stamps(), ElementsAre(2'020, 2'070, 2'200, 2'201));
}

TEST_F(FrameTimesFileTest, LeavesOtherRecordingsAlone) {
  ASSERT_TRUE(ApplyFrameTimes(Path("calibration.yaml"), &recording_));  // there is no such file
  std::ofstream(Path("frame_times.csv")) << "#stamp_ns,repaired_stamp_ns,sigma_ns\n77,78,1\n";
  ASSERT_TRUE(ApplyFrameTimes(Path("calibration.yaml"), &recording_));
  EXPECT_THAT(Stamps(), ElementsAre(2'000, 2'100, 2'200, 2'300));
  EXPECT_TRUE(recording_.notes.empty());
  std::ofstream(Path("frame_times.csv")) << "77,often,1\n";
  const Status refused = ApplyFrameTimes(Path("calibration.yaml"), &recording_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(refused.error().message, HasSubstr("frame_times.csv"));
}

}  // namespace
}  // namespace camgyro
