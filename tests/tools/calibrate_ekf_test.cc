// `camgyro calibrate --estimator=ekf`: the paper's filter as a user runs it.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using CalibrateEkfTest = CamgyroTest;

// A phone as the paper supposes it: mounting along the axes, t_r near 27.5 ms, t_d near 0, a
// declared angle of view, and tracks much better than the assumed 1 px.
constexpr char kPhone[] = R"(
duration_s: 5
motion: {kind: running}
camera: {resolution: [640, 480], focal_px: 560, readout_s: 0.026, delay_s: 0.008}
mount: {q_gyro_cam_wxyz: [0, -0.70710678, 0.70710678, 0]}
gyro: {bias_rad_s: [0.004, -0.003, 0.002], accelerometer: false}
tracks: {count: 60, noise_px: 0.05}
)";

TEST_F(CalibrateEkfTest, CalibratesAPhoneOfThePaper) {
  Simulate(kPhone, "a");
  const RunResult run = Run("calibrate a --estimator=ekf --focal_px=570 --out=result");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("the filter of Jia & Evans"), Not(HasSubstr("refinement")),
                             Not(HasSubstr("does not know"))));
  const YAML::Node result = YAML::LoadFile(Path("result/calibration.yaml"));
  EXPECT_NEAR(result["camera"]["focal_px"]["value"].as<double>(), 560.0, 3.0);
  EXPECT_NEAR(result["clock"]["delay_s"]["value"].as<double>(), 0.008, 0.6e-3);
  EXPECT_NEAR(result["shutter"]["readout_s"]["value"].as<double>(), 0.026, 0.8e-3);
  EXPECT_LT(result["clock"]["delay_s"]["sigma"].as<double>(), 1e-3);
  // One row for each of the 150 pairs.
  const std::string trace = ReadFile(Path("result/trace.csv"));
  EXPECT_EQ(std::count(trace.begin(), trace.end(), '\n'), 151);
}

// Of a picture that is higher than wide, columns may have been read, which the filter takes for
// rows.
TEST_F(CalibrateEkfTest, SaysWhatItDoesNotKnow) {
  std::string turned = std::string(kPhone) + "effects: {readout_direction: {columns: true}}\n";
  turned.replace(turned.find("[640, 480]"), 10, "[480, 640]");
  Simulate(turned, "a");
  const RunResult run = Run("calibrate a --estimator=ekf --focal_px=570 --out=result");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("does not know"));
  EXPECT_THAT(run.out, HasSubstr("readout_direction"));
}

TEST_F(CalibrateEkfTest, NeedsPixels) {
  Simulate(kPhone, "a");
  // Attitudes in place of tracks.
  std::ofstream attitudes(Path("a/cam0/attitude.csv"));
  attitudes << "#timestamp [ns],q_cam_world_w,x,y,z\n";
  std::stringstream frames(ReadFile(Path("a/cam0/data.csv")));
  std::string line;
  std::getline(frames, line);
  while (std::getline(frames, line)) attitudes << line.substr(0, line.find(',')) << ",1,0,0,0\n";
  attitudes.close();
  std::filesystem::remove(Path("a/cam0/tracks.csv"));
  const RunResult run = Run("calibrate a --estimator=ekf --out=result");
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_THAT(run.err, HasSubstr("the filter needs image motion"));
  EXPECT_FALSE(Exists("result"));
}

}  // namespace
}  // namespace camgyro
