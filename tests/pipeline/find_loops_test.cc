// Loops of a rendered walk: the device goes once and a bit round a block.
#include "pipeline/find_loops.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "frontend/readers/read_recording.h"
#include "frontend/track_recording.h"
#include "simulation/write_recording.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr char kRoundTheBlock[] =
    "{duration_s: 17.5, seed: 2, motion: {kind: walking, path_radius_m: 3},"
    " scene: {kind: corridor, room_m: [9, 3, 9], block_m: [3, 3]},"
    " camera: {resolution: [288, 216], focal_px: 234, rate_hz: 12},"
    " video: {format: mp4, max_blur_samples: 4}}";

class FindLoopsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("camgyro_find_loops_" + std::to_string(::getpid()));
    scenario_ = simulation::ParseScenario(kRoundTheBlock).value();
    simulated_ = simulation::SimulateSensors(scenario_).value();
    ASSERT_TRUE(simulation::WriteRecording(simulated_, scenario_, folder_.string()));
    recording_ = ReadRecording(folder_.string()).value();
    ASSERT_TRUE(TrackRecording({}, nullptr, nullptr, &recording_));
    calibration_ = simulated_.truth;
    StateVector sigma;
    sigma << 0.3, 0.5, 0.5, 1e-4, 1e-4, Vector3d::Constant(5e-4), Vector3d::Constant(1e-3);
    calibration_.covariance = sigma.cwiseAbs2().asDiagonal();
    OdometryOptions options;
    options.p_gyro_cam_m = scenario_.mount.p_gyro_cam_m;
    options.p_gyro_cam_sigma_m = 0.01;
    run_ = FollowRecording(recording_, calibration_,
                           WithDeclaredNoise(options, recording_.gyro_info), nullptr)
               .value();
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  // In a world with z up.
  static Eigen::Isometry3d TruePose(const OdometryPose& pose) {
    const simulation::CameraState state = simulated_.camera->trajectory().At(
        1e-9 * static_cast<double>(pose.time_ns - scenario_.start_ns));
    Eigen::Matrix3d R_up_down;
    R_up_down << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = R_up_down * state.R_world_cam * scenario_.mount.q_gyro_cam.conjugate();
    T.translation() = R_up_down * state.p_world_m - T.linear() * scenario_.mount.p_gyro_cam_m;
    return T;
  }

  static fs::path folder_;
  static simulation::Scenario scenario_;
  static simulation::Simulated simulated_;
  static Recording recording_;
  static Calibration calibration_;
  static OdometryRun run_;
};
fs::path FindLoopsTest::folder_;
simulation::Scenario FindLoopsTest::scenario_;
simulation::Simulated FindLoopsTest::simulated_;
Recording FindLoopsTest::recording_;
Calibration FindLoopsTest::calibration_;
OdometryRun FindLoopsTest::run_;

// Every loop is where the truth has it: what it says of the newer keyframe, seen from the older, is
// wrong by centimetres: 20 to 40 corners, each found to 3 mrad, on landmarks 2 to 5 m away. The
// next panel of the wall is 4.5 m away.
TEST_F(FindLoopsTest, LoopsAreWhereTheTruthHasThem) {
  ASSERT_EQ(run_.segments, 1) << run_.start_explanation;
  const auto closure = FindLoops(recording_, run_, 9.80665, nullptr);
  ASSERT_TRUE(closure) << closure.error().message;
  EXPECT_TRUE(closure->unavailable.empty());
  ASSERT_GE(closure->loops.size(), 1u) << closure->candidates << " candidates";
  EXPECT_EQ(closure->Believed(), static_cast<int>(closure->loops.size()));
  for (const FoundLoop& loop : closure->loops) {
    const OdometryPose& older = run_.keyframes[loop.edge.older];
    const OdometryPose& newer = run_.keyframes[loop.edge.newer];
    EXPECT_GT(newer.time_ns - older.time_ns, 10'000'000'000);
    EXPECT_GE(loop.sightings, 20);
    const Eigen::Isometry3d T_older = TruePose(older), T_newer = TruePose(newer);
    const Eigen::Quaterniond q_older = older.state.q_world_gyro, q_newer = newer.state.q_world_gyro;
    const Vector3d found = q_older.conjugate() * loop.edge.measured.p_a_b_m;
    const Vector3d expected =
        T_older.linear().transpose() * (T_newer.translation() - T_older.translation());
    EXPECT_LT((found - expected).norm(), 0.15) << loop.sightings;
    const Eigen::Quaterniond turned =
        Eigen::AngleAxisd(loop.edge.measured.yaw_a_b_rad, Vector3d::UnitZ()) * q_newer;
    const Eigen::Quaterniond relative(
        Eigen::Matrix3d(T_older.linear().transpose() * T_newer.linear()));
    EXPECT_LT((q_older.conjugate() * turned).angularDistance(relative), 0.04);
  }
  EXPECT_EQ(closure->keyframes.size(), run_.keyframes.size());
  EXPECT_EQ(closure->poses.size(), run_.poses.size());
}

TEST_F(FindLoopsTest, SameRecordingSameLoops) {
  const auto a = FindLoops(recording_, run_, 9.80665, nullptr);
  const auto b = FindLoops(recording_, run_, 9.80665, nullptr);
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->loops.size(), b->loops.size());
  for (size_t i = 0; i < a->loops.size(); ++i) {
    EXPECT_EQ(a->loops[i].edge.measured.p_a_b_m, b->loops[i].edge.measured.p_a_b_m);
  }
  for (size_t i = 0; i < a->keyframes.size(); ++i) {
    EXPECT_EQ(a->keyframes[i].state.p_world_m, b->keyframes[i].state.p_world_m);
  }
}

TEST_F(FindLoopsTest, TracksAloneHaveNoLoops) {
  Recording recording = recording_;
  recording.video_file.clear();
  const auto closure = FindLoops(recording, run_, 9.80665, nullptr);
  ASSERT_TRUE(closure);
  EXPECT_THAT(closure->unavailable, testing::HasSubstr("no pictures"));
  EXPECT_THAT(LoopsInWords(*closure), testing::HasSubstr("not looked for: no pictures"));
  EXPECT_TRUE(closure->keyframes.empty());
  EXPECT_TRUE(closure->poses.empty());
}

}  // namespace
}  // namespace camgyro
