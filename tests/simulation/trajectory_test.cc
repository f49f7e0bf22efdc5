#include "simulation/trajectory.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "core/so3.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Rates against central differences of the poses: 4th order, so that h = 1 ms errs below 1e-9.
void ExpectRatesAreDerivatives(const Trajectory& trajectory, double time_s) {
  const double h = 1e-3;
  const auto at = [&](double offset) { return trajectory.At(time_s + offset); };
  const CameraState now = at(0.0), a = at(h), b = at(-h), c = at(2 * h), d = at(-2 * h);
  const auto derivative = [&](const Vector3d& pa, const Vector3d& pb, const Vector3d& pc,
                              const Vector3d& pd) -> Vector3d {
    return (8.0 * (pa - pb) - (pc - pd)) / (12.0 * h);
  };
  const auto turn = [&](const CameraState& state) {
    return Log(Eigen::Quaterniond(now.R_world_cam.transpose() * state.R_world_cam));
  };
  SCOPED_TRACE(time_s);
  EXPECT_LT((derivative(turn(a), turn(b), turn(c), turn(d)) - now.omega_cam_rad_s).norm(), 1e-6);
  EXPECT_LT(
      (derivative(a.p_world_m, b.p_world_m, c.p_world_m, d.p_world_m) - now.v_world_m_s).norm(),
      1e-6);
  EXPECT_LT(
      (derivative(a.v_world_m_s, b.v_world_m_s, c.v_world_m_s, d.v_world_m_s) - now.a_world_m_s2)
          .norm(),
      1e-4);
  EXPECT_LT(
      (derivative(a.omega_cam_rad_s, b.omega_cam_rad_s, c.omega_cam_rad_s, d.omega_cam_rad_s) -
       now.alpha_cam_rad_s2)
          .norm(),
      1e-4);
}

std::shared_ptr<const Trajectory> Make(const Scenario& scenario) {
  std::mt19937_64 random(3);
  return MakeTrajectory(scenario, &random).value();
}

class EveryMotion : public testing::TestWithParam<MotionKind> {};

TEST_P(EveryMotion, RatesAreExactDerivatives) {
  Scenario scenario;
  scenario.motion = MotionPreset(GetParam());
  scenario.effects.translation_acceleration.shake_m_s = 0.3;
  const auto straight = Make(scenario);
  scenario.motion.path_radius_m = 2.0;
  const auto circle = Make(scenario);
  for (double t = -0.3; t < 12.0; t += 0.71) {
    ExpectRatesAreDerivatives(*straight, t);
    ExpectRatesAreDerivatives(*circle, t);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryMotion,
                         testing::Values(MotionKind::kHandheld, MotionKind::kWalking,
                                         MotionKind::kRunning, MotionKind::kPanning,
                                         MotionKind::kRotation, MotionKind::kSingleAxis,
                                         MotionKind::kSlow));

TEST(Trajectory, HandheldTurnsAsFastAsAsked) {
  const auto trajectory = Make(Scenario());
  double sum = 0.0;
  const int count = 6000;
  for (int i = 0; i < count; ++i) sum += trajectory->At(0.05 * i).omega_cam_rad_s.squaredNorm();
  EXPECT_NEAR(std::sqrt(sum / count), 0.8, 0.03);  // 300 s of a band above 0.3 Hz
}

TEST(Trajectory, PureRotationStaysWhereItIs) {
  Scenario scenario;
  scenario.motion = MotionPreset(MotionKind::kRotation);
  const auto trajectory = Make(scenario);
  for (double t = 0.0; t < 10.0; t += 0.5) {
    EXPECT_EQ(trajectory->At(t).p_world_m, trajectory->At(0.0).p_world_m);
  }
}

TEST(Trajectory, CircleLooksAlongItsPath) {
  Scenario scenario;
  scenario.motion = MotionPreset(MotionKind::kRotation);
  scenario.motion.rotation_rms_rad_s.setZero();
  scenario.motion.speed_m_s = 2.0;
  scenario.motion.heading_deg = 0.0;
  scenario.motion.path_radius_m = 3.0;
  const auto trajectory = Make(scenario);
  for (double t = 0.0; t < 10.0; t += 0.9) {
    const CameraState state = trajectory->At(t);
    EXPECT_NEAR(state.p_world_m.norm(), 3.0, 1e-12);
    EXPECT_LT((state.R_world_cam.col(2) * 2.0 - state.v_world_m_s).norm(), 1e-12);
    EXPECT_LT((state.omega_cam_rad_s - Vector3d(0, 2.0 / 3.0, 0)).norm(), 1e-12);
  }
}

class TrajectoryFile : public testing::Test {
 protected:
  std::string Write(const std::string& text) {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    const std::string path = testing::TempDir() + "/camgyro_trajectory_" + test->name();
    std::ofstream(path) << text;
    return path;
  }
};

TEST_F(TrajectoryFile, FollowsTheFileSmoothly) {
  // A camera that rises at 0.5 m/s and yaws at 1 rad/s about the vertical, in TUM's z-up world,
  // starting with the view (z) along the file's y: a cubic B-spline reproduces both exactly.
  const Matrix3d R_start = (Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished();
  std::string text = "# t x y z qx qy qz qw\n";
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.02 * i;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(t, Vector3d::UnitZ()) * R_start);
    char line[256];
    std::snprintf(line, sizeof line, "%.6f 0 0 %.9f %.15f %.15f %.15f %.15f\n", 100.0 + t, 0.5 * t,
                  q.x(), q.y(), q.z(), q.w());
    text += line;
  }
  const auto trajectory = ReadTrajectory(Write(text), 0.1, Eigen::Isometry3d::Identity()).value();
  for (double t = 0.35; t < 1.7; t += 0.17) {
    ExpectRatesAreDerivatives(*trajectory, t);
    const CameraState state = trajectory->At(t);
    EXPECT_LT((state.p_world_m - Vector3d(0, -0.5 * t, 0)).norm(), 1e-9);  // y is down
    EXPECT_LT((state.omega_cam_rad_s - Vector3d(0, -1, 0)).norm(), 1e-6);  // left, seen from above
    EXPECT_LT((state.R_world_cam.col(2) - Vector3d(-std::sin(t), 0, std::cos(t))).norm(), 1e-6);
  }
}

TEST_F(TrajectoryFile, RefusesWhatIsNoTrajectory) {
  const Eigen::Isometry3d identity = Eigen::Isometry3d::Identity();
  EXPECT_THAT(ReadTrajectory("/nowhere.txt", 0.05, identity).error().message,
              testing::HasSubstr("/nowhere.txt"));
  EXPECT_THAT(ReadTrajectory(Write("0 0 0 0 0 0 0 2\n"), 0.05, identity).error().message,
              testing::HasSubstr(":1: expected"));
  EXPECT_THAT(
      ReadTrajectory(Write("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"), 0.05, identity).error().message,
      testing::HasSubstr(":2: the time does not increase"));
}

}  // namespace
}  // namespace camgyro::simulation
