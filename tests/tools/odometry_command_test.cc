// `camgyro odometry` as a user runs it.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

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
  EXPECT_EQ(yaml["refined"]["noise_of"].as<std::string>(), "sightings");
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

struct TumRow {
  double time_s = 0.0;
  Eigen::Vector3d p_m;
  Eigen::Quaterniond q;
};

std::vector<TumRow> ReadTum(const std::string& text) {
  std::vector<TumRow> rows;
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    TumRow row;
    words >> row.time_s >> row.p_m.x() >> row.p_m.y() >> row.p_m.z() >> row.q.x() >> row.q.y() >>
        row.q.z() >> row.q.w();
    rows.push_back(row);
  }
  return rows;
}

// Position there, from the rows on both sides.
Eigen::Vector3d PositionAt(const std::vector<TumRow>& rows, double time_s) {
  const auto after = std::lower_bound(rows.begin() + 1, rows.end() - 1, time_s,
                                      [](const TumRow& r, double t) { return r.time_s < t; });
  const TumRow& before = *(after - 1);
  const double share = (time_s - before.time_s) / (after->time_s - before.time_s);
  return before.p_m + share * (after->p_m - before.p_m);
}

TEST_F(OdometryCommandTest, WritesTheWayAtTheGyrosRate) {
  Simulate(kWalk, "a");
  const RunResult run =
      Run("odometry a --calibration=a/truth.yaml --lever_arm_mm=30,50,0 --rate=gyro --out=b");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr(", gyro_rate.tum\n"));
  const auto rows = ReadTum(ReadFile(Path("b/gyro_rate.tum")));
  const auto keyframes = ReadTum(ReadFile(Path("b/keyframes.tum")));
  const auto frames = ReadTum(ReadFile(Path("b/trajectory.tum")));
  const auto truth = ReadTum(ReadFile(Path("a/truth_trajectory.tum")));
  ASSERT_GT(keyframes.size(), 10u);
  // 200 samples per second, all between the first and the last keyframe.
  ASSERT_NEAR(static_cast<double>(rows.size()),
              200.0 * (keyframes.back().time_s - keyframes.front().time_s), 2.0);
  // Through the keyframes; straight lines between samples are off by g (5 ms)^2 / 8 and less.
  for (size_t i = 1; i + 1 < keyframes.size(); ++i) {
    EXPECT_LT((PositionAt(rows, keyframes[i].time_s) - keyframes[i].p_m).norm(), 1e-4);
  }
  // Of frames, as they were known at their time, and of the truth, turned to the first keyframe's
  // yaw and place: as near as some seconds of a walk allow.
  const auto begin = std::find_if(truth.begin(), truth.end(), [&](const TumRow& r) {
    return r.time_s > keyframes.front().time_s - 1e-4;
  });
  ASSERT_NE(begin, truth.end());
  const Eigen::Matrix3d R = (keyframes.front().q * begin->q.conjugate()).toRotationMatrix();
  const Eigen::AngleAxisd yaw(std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1)),
                              Eigen::Vector3d::UnitZ());
  int compared = 0;
  for (auto row = begin; row != truth.end() && row->time_s < keyframes.back().time_s; ++row) {
    const Eigen::Vector3d there = keyframes.front().p_m + yaw * (row->p_m - begin->p_m);
    EXPECT_LT((PositionAt(rows, row->time_s) - there).norm(), 0.08);
    ++compared;
  }
  EXPECT_GT(compared, 100);
  for (const TumRow& frame : frames) {
    if (frame.time_s > keyframes.back().time_s) continue;
    EXPECT_LT((PositionAt(rows, frame.time_s) - frame.p_m).norm(), 0.08);
  }
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
  for (const char* flag :
       {"--keyframes=3", "--gravity=1.6", "--loops=maybe", "--rate=fast", "--lever_arm_mm=1,2",
        "--lever_arm_mm=1,2,x", "--lever_arm_sigma_mm=0"}) {
    run = Run(std::string("odometry a --calibration=a/truth.yaml --out=e ") + flag);
    EXPECT_EQ(run.exit_code, 2) << flag;
    EXPECT_THAT(run.err, HasSubstr("expected")) << flag;
  }
  EXPECT_FALSE(Exists("e"));
}

}  // namespace
}  // namespace camgyro
