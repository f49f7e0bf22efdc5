// `camgyro rectify` as a user runs it.
#include <gmock/gmock.h>

#include <opencv2/core.hpp>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

constexpr char kTracks[] = R"(
duration_s: 1
seed: 5
camera: {readout_s: 0.025, exposure_s: 0.002}
)";

class RectifyCommandTest : public CamgyroTest {
 protected:
  void ExpectNothingLeft(const std::string& name) const {
    EXPECT_FALSE(Exists(name));
    for (const auto& entry : std::filesystem::directory_iterator(Path(""))) {
      EXPECT_EQ(entry.path().string().find(".tmp"), std::string::npos) << entry.path();
    }
  }
};

TEST_F(RectifyCommandTest, WritesARecordingOfTracksWithItsConfiguration) {
  Simulate(kTracks, "a");
  const RunResult run =
      Run("rectify a --calibration=a/truth.yaml --out=b/c --undistort --format=openvins");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("rectified  31 frames, points moved by"));
  const auto before = ReadRecording(Path("a")), after = ReadRecording(Path("b/c"));
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_TRUE(after->faults.empty());
  EXPECT_EQ(after->tracks.size(), before->tracks.size());
  EXPECT_EQ(after->gyro.size(), before->gyro.size());
  EXPECT_EQ(after->accel.size(), before->accel.size());
  EXPECT_EQ(after->camera.readout_s, 0.0);
  EXPECT_EQ(after->camera.delay_s, 0.0);
  EXPECT_NEAR(*after->camera.focal_px, 650.0, 1e-9);
  // 15 ms of delay, and half of the readout of 25 ms.
  EXPECT_EQ(after->frames[3].stamp_ns - before->frames[3].stamp_ns, 27500000);
  EXPECT_EQ(after->frames[3].exposure_s, before->frames[3].exposure_s);
  EXPECT_THAT(ReadFile(Path("b/c/openvins/kalibr_imucam_chain.yaml")),
              HasSubstr("timeshift_cam_imu: 0"));
  EXPECT_FALSE(Exists("b/c/cam0/data"));
}

TEST_F(RectifyCommandTest, WritesPictures) {
  Simulate(
      "{duration_s: 0.3, seed: 2, scene: {kind: room}, video: {format: mp4, max_blur_samples: 4},"
      " camera: {resolution: [160, 120], focal_px: 130, exposure_s: 0.002}}",
      "a");
  ASSERT_EQ(Run("rectify a --calibration=a/truth.yaml --out=b").exit_code, 0);
  const auto before = ReadRecording(Path("a")), after = ReadRecording(Path("b"));
  ASSERT_TRUE(after) << after.error().message;
  ASSERT_EQ(after->frames.size(), before->frames.size());
  auto recorded = OpenFrames(*before), rectified = OpenFrames(*after);
  cv::Mat a, b;
  ASSERT_TRUE((*recorded)->Next(&a).value_or(false));
  ASSERT_TRUE((*rectified)->Next(&b).value_or(false));
  ASSERT_EQ(a.size(), b.size());
  // The middle row is exposed at the picture's time, and stays as it is; the top row does not.
  const auto difference = [&](int row) {
    return cv::norm(a.row(row).colRange(20, 140), b.row(row).colRange(20, 140), cv::NORM_L1) / 120;
  };
  EXPECT_LT(difference(60), 1.0);
  EXPECT_GT(difference(10), 2.0 * difference(60));
}

TEST_F(RectifyCommandTest, RefusesWithoutLeavingAnything) {
  Simulate(kTracks, "a");
  const auto expect = [&](const std::string& arguments, int code, const std::string& message) {
    const RunResult run = Run("rectify " + arguments);
    EXPECT_EQ(run.exit_code, code) << arguments;
    EXPECT_THAT(run.err, HasSubstr(message));
    ExpectNothingLeft("b");
  };
  expect("a --out=b", 2, "--calibration=FILE is needed");
  expect("a --calibration=a/truth.yaml", 2, "--out=DIR is needed");
  expect("a --calibration=a/truth.yaml --out=b --format=x", 2, "expected one of kalibr");
  expect("a --calibration=a/truth.yaml --out=a", 2, "expected a new or empty folder");
  expect("a --calibration=none.yaml --out=b", 3, "none.yaml");
  expect("nowhere --calibration=a/truth.yaml --out=b", 3, "nowhere");
  const auto with_effect = [&](const std::string& effect) {
    std::string yaml = ReadFile(Path("a/truth.yaml"));
    return yaml.replace(yaml.find("effects: []"), 11, "effects: [{name: " + effect + "}]");
  };
  std::ofstream(Path("columns.yaml"))
      << with_effect("readout_direction, parameters: [{value: -0.03, sigma: 0.001}]");
  expect("a --calibration=columns.yaml --out=b", 3, "columns.yaml: the pictures are read column");
  // Where the lens was is not in this recording; odometry holds it still in any case.
  std::ofstream(Path("lens.yaml")) << with_effect("optical_stabilisation, shape: logged");
  expect("a --calibration=lens.yaml --out=b", 3, "lens.yaml: effects: optical_stabilisation: not");
  const RunResult odometry = Run("odometry a --calibration=lens.yaml --out=b");
  EXPECT_EQ(odometry.exit_code, 3);
  EXPECT_THAT(odometry.err, HasSubstr("lens.yaml: the lens moves as the camera turns"));
}

}  // namespace
}  // namespace camgyro
