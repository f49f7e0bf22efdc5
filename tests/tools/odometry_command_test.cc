// `camgyro odometry` as a user runs it.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr char kWalk[] =
    "{duration_s: 6, seed: 3, motion: {kind: walking}, tracks: {count: 60, noise_px: 0.5}}";

using OdometryCommandTest = CamgyroTest;

TEST_F(OdometryCommandTest, WritesWhereTheDeviceWent) {
  Simulate(kWalk, "a");
  const RunResult run =
      Run("odometry a --calibration=a/truth.yaml --lever_arm_mm=30,50,0 --keyframes=10 --out=b");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("verdict    tracked"));
  const YAML::Node yaml = YAML::LoadFile(Path("b/odometry.yaml"));
  EXPECT_EQ(yaml["verdict"].as<std::string>(), "tracked");
  EXPECT_EQ(yaml["segments"].as<int>(), 1);
  EXPECT_NEAR(yaml["path_m"].as<double>(), 6.0 * 1.2, 1.5);
  EXPECT_NEAR(yaml["refined"]["delay_s"]["value"].as<double>(), 0.015, 1e-4);
  EXPECT_EQ(yaml["events"][0]["event"].as<std::string>(), "started");
  EXPECT_THAT(ReadFile(Path("b/trajectory.csv")), StartsWith("#time_ns,frame_stamp_ns,segment"));
  EXPECT_THAT(ReadFile(Path("b/points.ply")), StartsWith("ply\n"));
  EXPECT_THAT(ReadFile(Path("b/report.html")), HasSubstr("<polyline"));
  // Ready tracks have no loops, and nobody looked.
  EXPECT_THAT(run.out, HasSubstr("loops      not looked for: no pictures"));
  EXPECT_FALSE(yaml["loops"]["looked_for"].as<bool>());
  EXPECT_FALSE(Exists("b/closed.tum"));
  // One line per frame from the start on, and one for the names.
  const std::string tum = ReadFile(Path("b/trajectory.tum"));
  EXPECT_EQ(std::count(tum.begin(), tum.end(), '\n'), yaml["frames"].as<int>() + 1);
}

TEST_F(OdometryCommandTest, SaysWhatIsMissing) {
  Simulate("{duration_s: 1, seed: 1, gyro: {accelerometer: false}}", "a");
  RunResult run = Run("odometry a --out=b");  // and does not calibrate first
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("has no accelerometer"));
  Simulate("{duration_s: 3, seed: 1, motion: {kind: rotation}}", "c");
  run = Run("odometry c --calibration=c/truth.yaml --out=d");
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_THAT(run.err, HasSubstr("odometry did not start: "));
  EXPECT_THAT(ReadFile(Path("d/odometry.yaml")), HasSubstr("not started"));
  EXPECT_FALSE(Exists("d/trajectory.tum"));
  for (const char* flag : {"--keyframes=3", "--gravity=1.6", "--loops=maybe", "--lever_arm_mm=1,2",
                           "--lever_arm_mm=1,2,x", "--lever_arm_sigma_mm=0"}) {
    run = Run(std::string("odometry a --calibration=a/truth.yaml --out=e ") + flag);
    EXPECT_EQ(run.exit_code, 2) << flag;
    EXPECT_THAT(run.err, HasSubstr("expected")) << flag;
  }
  EXPECT_FALSE(Exists("e"));
}

}  // namespace
}  // namespace camgyro
