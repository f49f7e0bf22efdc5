#include "estimator/odometry/gyro_rate_trajectory.h"

#include <gtest/gtest.h>

#include "core/time.h"
#include "tests/estimator/odometry/walk.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

OdometryPose AsPose(const StateAtTime& at) {
  OdometryPose pose;
  pose.time_ns = at.time_ns;
  pose.segment = at.segment;
  pose.state = at.state;
  return pose;
}

// A walk without noise, and its true states at every 50th gyro sample, that is every 0.25 s.
struct TrueKeyframes {
  TrueKeyframes() {
    simulation::Scenario scenario = WalkingScenario(4.0);
    scenario.gyro.noise_density_rad_s_rtHz = scenario.gyro.accel_noise_density_m_s2_rtHz = 0.0;
    scenario.gyro.bias_walk_rad_s2_rtHz = 0.0;
    walk = WalkOf(scenario);
    const Recording& r = walk.simulated.recording;
    OdometryPose origin;
    origin.time_ns = r.gyro[100].stamp_ns;
    // Upright as the simulator's camera is at time 0; any pose would do.
    const Eigen::Quaterniond up = UpOfSimulator();
    for (size_t i = 100; i + 100 < r.gyro.size(); i += 50) {
      const VinsState truth = TrueState(walk.simulated, walk.scenario, r.gyro[i].stamp_ns);
      OdometryPose pose;
      pose.time_ns = r.gyro[i].stamp_ns;
      pose.state.q_world_gyro = up * truth.q_world_gyro;
      pose.state.p_world_m = up * truth.p_world_m;
      pose.state.v_world_m_s = up * truth.v_world_m_s;
      pose.state.bias_gyro_rad_s = walk.simulated.truth.bias_gyro_rad_s;
      poses.push_back(pose);
    }
  }
  std::vector<StateAtTime> Between() const {
    const Recording& r = walk.simulated.recording;
    return AtGyroRate(r.gyro, r.accel, poses, 9.80665);
  }
  Walk walk;
  std::vector<OdometryPose> poses;
};

TEST(GyroRateTrajectory, IsTheTruthBetweenTrueKeyframes) {
  const TrueKeyframes keyframes;
  const std::vector<StateAtTime> states = keyframes.Between();
  ASSERT_EQ(states.size(), 50 * (keyframes.poses.size() - 1));
  const TruthFrom truth(keyframes.walk, keyframes.poses.front());
  // Parabolas between samples at 200 Hz of what swings at 4 Hz at most leave some micrometres.
  for (const StateAtTime& at : states) {
    EXPECT_LT(truth.PositionError(AsPose(at)).norm(), 2e-5);
    EXPECT_LT(truth.VelocityError(AsPose(at)).norm(), 1e-4);
    EXPECT_LT(truth.RotationError(AsPose(at)).norm(), 1e-5);
  }
}

// Keyframes that contradict the inertial data: the way goes through them all the same, and
// position, velocity and rotation do not jump there.
TEST(GyroRateTrajectory, GoesThroughEveryKeyframeWithoutAJump) {
  TrueKeyframes keyframes;
  for (size_t k = 0; k < keyframes.poses.size(); ++k) {
    NavigationState& state = keyframes.poses[k].state;
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    state.p_world_m += sign * Vector3d(0.02, -0.01, 0.03);
    state.v_world_m_s += sign * Vector3d(-0.05, 0.04, 0.02);
    state.q_world_gyro = state.q_world_gyro * Exp(Vector3d(sign * Vector3d(0.01, 0.02, -0.01)));
  }
  const Recording& r = keyframes.walk.simulated.recording;
  const std::vector<StateAtTime> states = keyframes.Between();
  ASSERT_GT(states.size(), 200u);
  const int64_t origin_ns = states.front().time_ns;
  const ImuIntegral imu(r.gyro, r.accel, origin_ns, states.front().state.bias_gyro_rad_s);
  for (size_t i = 0; i + 1 < states.size(); ++i) {
    if (i % 50 == 0) {
      const NavigationState& keyframe = keyframes.poses[i / 50].state;
      EXPECT_LT((states[i].state.p_world_m - keyframe.p_world_m).norm(), 1e-12);
      EXPECT_LT((states[i].state.v_world_m_s - keyframe.v_world_m_s).norm(), 1e-12);
    }
    // One sample further by the inertial data: what the correction adds in 5 ms is at most the
    // quickest change of its terms, 2 |dp| = 0.08 m in 0.25 s by 1.5 and 2 |dv| = 0.14 m/s; a
    // correction that came at once would be 0.08 m.
    const NavigationState next =
        Predict(states[i].state,
                imu.Between(SecondsSince(origin_ns, states[i].time_ns),
                            SecondsSince(origin_ns, states[i + 1].time_ns)),
                9.80665);
    EXPECT_LT((states[i + 1].state.p_world_m - next.p_world_m).norm(), 5e-3 * 0.7 + 1e-4);
    EXPECT_LT((states[i + 1].state.v_world_m_s - next.v_world_m_s).norm(), 5e-3 * 12.0);
    EXPECT_LT(
        Log(Eigen::Quaterniond(next.q_world_gyro.conjugate() * states[i + 1].state.q_world_gyro))
            .norm(),
        1.1 * 0.049 / 50.0);
  }
}

TEST(GyroRateTrajectory, SaysNothingBetweenSegments) {
  TrueKeyframes keyframes;
  const size_t all = keyframes.Between().size();
  for (size_t k = 3; k < keyframes.poses.size(); ++k) keyframes.poses[k].segment = 1;
  const std::vector<StateAtTime> states = keyframes.Between();
  EXPECT_EQ(states.size(), all - 50);
  for (const StateAtTime& at : states) {
    EXPECT_TRUE(at.time_ns < keyframes.poses[2].time_ns ||
                at.time_ns >= keyframes.poses[3].time_ns);
    EXPECT_EQ(at.segment, at.time_ns < keyframes.poses[2].time_ns ? 0 : 1);
  }
}

// Of an odometry: as near to the truth as its keyframes are.
TEST(GyroRateTrajectory, FollowsAWalk) {
  const Walk walk = WalkFor(6.0);
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  ASSERT_EQ(run->segments, 1) << run->start_explanation;
  const Recording& r = walk.simulated.recording;
  const std::vector<StateAtTime> states =
      AtGyroRate(r.gyro, r.accel, run->keyframes, walk.options.gravity_m_s2);
  // 200 of them in a second.
  const double span_s = SecondsSince(run->keyframes.front().time_ns, run->keyframes.back().time_ns);
  EXPECT_NEAR(static_cast<double>(states.size()), 200.0 * span_s, 2.0);
  std::vector<OdometryPose> poses(states.size());
  std::transform(states.begin(), states.end(), poses.begin(), AsPose);
  const TruthFrom truth(walk, run->keyframes.front());
  EXPECT_LT(Largest(poses, truth), Largest(run->keyframes, truth) + 2e-3);
}

}  // namespace
}  // namespace camgyro
