// The pose graph on ways that are made up: what it does with good loops, wrong loops and none, and
// whether its covariance is that of its errors.
#include "estimator/odometry/pose_graph.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/linear_algebra.h"

namespace camgyro {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr int kLap = 60;                                    // keyframes of one lap of 60 m
constexpr double kStepM = 1.0;                              // between keyframes
constexpr double kWaySigmaM = 0.02, kTurnSigmaRad = 0.002;  // of each step
constexpr double kLoopSigmaM = 0.02, kLoopTurnSigmaRad = 0.003;

// Two laps of a circle. The gyro is mounted anyhow.
struct Way {
  std::vector<OdometryPose> truth, odometry;
  std::mt19937_64 random;
  std::normal_distribution<double> normal;

  Vector4d Noise(double sigma_m, double sigma_rad) {
    const double x = normal(random), y = normal(random), z = normal(random), yaw = normal(random);
    return {sigma_m * x, sigma_m * y, sigma_m * z, sigma_rad * yaw};
  }

  explicit Way(uint64_t seed) : random(seed) {
    const Eigen::Quaterniond mount =
        Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Vector3d::UnitX())) *
        Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Vector3d::UnitY()));
    const double radius_m = kLap * kStepM / (2.0 * M_PI);
    Vector3d p = Vector3d::Zero();
    double yaw_error = 0.0;
    Matrix4d C = Matrix4d::Zero();  // of (p, yaw) of the odometry
    for (int i = 0; i < 2 * kLap; ++i) {
      const double angle = 2.0 * M_PI * i / kLap;
      OdometryPose pose;
      pose.time_ns = 500000000LL * i;
      pose.state.p_world_m = {radius_m * (std::cos(angle) - 1.0), radius_m * std::sin(angle), 0.0};
      pose.state.q_world_gyro =
          Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ())) * mount;
      pose.state.v_world_m_s = 2.0 * kStepM * Vector3d(-std::sin(angle), std::cos(angle), 0.0);
      truth.push_back(pose);
      const Eigen::AngleAxisd before(yaw_error, Vector3d::UnitZ());
      if (i > 0) {
        const Vector3d step =
            before * (pose.state.p_world_m - truth[truth.size() - 2].state.p_world_m);
        const Vector4d noise = Noise(kWaySigmaM, kTurnSigmaRad);
        p += step + noise.head<3>();
        yaw_error += noise[3];
        Matrix4d F = Matrix4d::Identity();
        F.block<3, 1>(0, 3) = Vector3d::UnitZ().cross(step + noise.head<3>());
        C = F * C * F.transpose();
        C.diagonal() += Vector4d(kWaySigmaM, kWaySigmaM, kWaySigmaM, kTurnSigmaRad).cwiseAbs2();
      }
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw_error, Vector3d::UnitZ()));
      pose.state.p_world_m = p;
      pose.state.q_world_gyro = turn * pose.state.q_world_gyro;
      pose.state.v_world_m_s = turn * pose.state.v_world_m_s;
      Eigen::Matrix<double, kNavSize, 4> J = Eigen::Matrix<double, kNavSize, 4>::Zero();
      J.block<3, 3>(kNavPosition, 0).setIdentity();
      J.block<3, 1>(kNavRotation, 3) = pose.state.q_world_gyro.conjugate() * Vector3d::UnitZ();
      pose.covariance = J * C * J.transpose();
      odometry.push_back(pose);
    }
  }

  double TurnError(size_t i, const OdometryPose& pose) const {
    return Eigen::AngleAxisd(pose.state.q_world_gyro * truth[i].state.q_world_gyro.conjugate())
               .axis()
               .z() *
           Eigen::AngleAxisd(pose.state.q_world_gyro * truth[i].state.q_world_gyro.conjugate())
               .angle();
  }

  // The newer keyframe seen from the older, in the world as the odometry had it at the older.
  LoopEdge Loop(size_t older, size_t newer) {
    LoopEdge loop{older, newer, {}};
    const Eigen::AngleAxisd turn(TurnError(older, odometry[older]), Vector3d::UnitZ());
    const Vector4d noise = Noise(kLoopSigmaM, kLoopTurnSigmaRad);
    loop.measured.p_a_b_m =
        turn * (truth[newer].state.p_world_m - truth[older].state.p_world_m) + noise.head<3>();
    loop.measured.yaw_a_b_rad =
        TurnError(older, odometry[older]) - TurnError(newer, odometry[newer]) + noise[3];
    loop.measured.covariance =
        Vector4d(kLoopSigmaM, kLoopSigmaM, kLoopSigmaM, kLoopTurnSigmaRad).cwiseAbs2().asDiagonal();
    return loop;
  }

  double Error(const std::vector<OdometryPose>& poses) const {
    double squared = 0.0;
    for (size_t i = 0; i < poses.size(); ++i) {
      squared += (poses[i].state.p_world_m - truth[i].state.p_world_m).squaredNorm();
    }
    return std::sqrt(squared / static_cast<double>(poses.size()));
  }
};

TEST(PoseGraph, WithoutLoopsNothingMoves) {
  const Way way(1);
  const auto closed = CloseLoops(way.odometry, {});
  ASSERT_TRUE(closed);
  for (size_t i = 0; i < way.odometry.size(); ++i) {
    EXPECT_EQ(closed->keyframes[i].state.p_world_m, way.odometry[i].state.p_world_m);
    EXPECT_EQ(closed->keyframes[i].covariance, way.odometry[i].covariance);
  }
}

// The chain of increments has the covariance that the odometry claims of its end, and each has what
// its step was made with.
TEST(PoseGraph, IncrementsAddUpToWhatTheOdometryClaims) {
  const Way way(2);
  for (size_t i = 0; i + 1 < way.odometry.size(); ++i) {
    const Matrix4d Q = WayBetween(way.odometry[i], way.odometry[i + 1]).covariance;
    const Matrix4d expected =
        Vector4d(kWaySigmaM, kWaySigmaM, kWaySigmaM, kTurnSigmaRad).cwiseAbs2().asDiagonal();
    EXPECT_LT((Q - expected).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST(PoseGraph, ALoopTakesTheDriftOut) {
  Way way(3);
  std::vector<LoopEdge> loops;
  for (size_t i = 0; i < kLap; i += 10) loops.push_back(way.Loop(i, i + kLap));
  const auto closed = CloseLoops(way.odometry, loops);
  ASSERT_TRUE(closed);
  EXPECT_THAT(closed->believed, testing::Each(true));
  // The second lap is as good as the first.
  const auto last = closed->keyframes.size() - 1;
  const auto error = [&](const OdometryPose& pose, size_t i) {
    return (pose.state.p_world_m - way.truth[i].state.p_world_m).norm();
  };
  EXPECT_GT(error(way.odometry[last], last), 0.5);
  EXPECT_LT(error(closed->keyframes[last], last), 0.15);
  EXPECT_LT(way.Error(closed->keyframes), 0.6 * way.Error(way.odometry));
  // Velocity and orientation turn along.
  const NavigationState& state = closed->keyframes[last].state;
  EXPECT_LT(std::abs(way.TurnError(last, closed->keyframes[last])), 0.015);
  const Eigen::AngleAxisd turned(way.TurnError(last, closed->keyframes[last]), Vector3d::UnitZ());
  EXPECT_LT((state.v_world_m_s - turned * way.truth[last].state.v_world_m_s).norm(), 1e-6);
}

// One wrong loop in three, metres off: they are not believed, and move nothing.
TEST(PoseGraph, WrongLoopsAreNotBelieved) {
  Way way(4);
  std::vector<LoopEdge> good, all;
  std::vector<bool> expected;
  for (size_t i = 0; i < kLap; i += 6) {
    good.push_back(way.Loop(i, i + kLap));
    all.push_back(good.back());
    expected.push_back(true);
    if (i % 12 != 0) continue;
    all.push_back(way.Loop(i, i + kLap / 2));
    all.back().measured.p_a_b_m.setZero();  // the far side of the circle taken for this one
    expected.push_back(false);
  }
  const auto without = CloseLoops(way.odometry, good), with = CloseLoops(way.odometry, all);
  ASSERT_TRUE(without);
  ASSERT_TRUE(with);
  EXPECT_EQ(with->believed, expected);
  for (size_t i = 0; i < way.odometry.size(); ++i) {
    EXPECT_LT((with->keyframes[i].state.p_world_m - without->keyframes[i].state.p_world_m).norm(),
              1e-3);
  }
}

TEST(PoseGraph, AWrongLoopAloneMovesNothing) {
  Way way(5);
  LoopEdge wrong = way.Loop(0, kLap / 2);
  wrong.measured.p_a_b_m.setZero();
  const auto closed = CloseLoops(way.odometry, {wrong});
  ASSERT_TRUE(closed);
  EXPECT_THAT(closed->believed, testing::ElementsAre(false));
  EXPECT_EQ(way.Error(closed->keyframes), way.Error(way.odometry));
}

// e' C^-1 e / 3 of positions over many ways is 1, with loops as without.
TEST(PoseGraph, CovarianceIsHonest) {
  double with = 0.0, without = 0.0;
  constexpr int kWays = 100;
  for (uint64_t seed = 1; seed <= kWays; ++seed) {
    Way way(100 + seed);
    std::vector<LoopEdge> loops;
    for (size_t i = 0; i < kLap; i += 10) loops.push_back(way.Loop(i, i + kLap));
    const auto closed = CloseLoops(way.odometry, loops);
    ASSERT_TRUE(closed);
    const auto nees = [&](const OdometryPose& pose, size_t i) {
      const Vector3d e = pose.state.p_world_m - way.truth[i].state.p_world_m;
      return SquaredMahalanobis(e, pose.covariance.block<3, 3>(kNavPosition, kNavPosition)) / 3.0;
    };
    const size_t last = way.truth.size() - 1;
    with += nees(closed->keyframes[last], last) / kWays;
    without += nees(way.odometry[last], last) / kWays;
  }
  // 300 degrees of freedom: 99.9 % within 0.75 and 1.29.
  EXPECT_GT(with, 0.75);
  EXPECT_LT(with, 1.29);
  EXPECT_GT(without, 0.75);
  EXPECT_LT(without, 1.29);
}

// An odometry that claims sigmas four times too small is found out by its loops.
TEST(PoseGraph, SigmasAreWidenedWhereLoopsContradictThem) {
  double nees = 0.0, factor = 0.0;
  constexpr int kWays = 30;
  for (uint64_t seed = 1; seed <= kWays; ++seed) {
    Way way(300 + seed);
    for (OdometryPose& pose : way.odometry) pose.covariance /= 16.0;
    std::vector<LoopEdge> loops;
    for (size_t i = 0; i < kLap; i += 2) loops.push_back(way.Loop(i, i + kLap));
    const auto closed = CloseLoops(way.odometry, loops);
    ASSERT_TRUE(closed);
    factor += closed->variance_factor / kWays;
    const size_t last = way.truth.size() - 1;
    const OdometryPose& pose = closed->keyframes[last];
    const Vector3d e = pose.state.p_world_m - way.truth[last].state.p_world_m;
    const auto C = pose.covariance.block<3, 3>(kNavPosition, kNavPosition);
    nees += SquaredMahalanobis(e, C) / 3.0 / kWays;
  }
  EXPECT_GT(factor, 2.0);
  EXPECT_LT(nees, 10.0);  // without the factor: of the order of 16
}

// Frames whose world is turned and shifted against that of the keyframes, the more the later, come
// to lie where the truth is.
TEST(MoveWithKeyframes, FramesFollowTheirKeyframes) {
  Way way(7);
  std::vector<OdometryPose> frames, keyframes;
  for (size_t i = 0; i < way.truth.size(); ++i) {
    OdometryPose& truth = way.truth[i];
    truth.frame_stamp_ns = truth.time_ns - 20'000'000;
    truth.covariance.setIdentity();
    truth.covariance *= static_cast<double>(i);
    OdometryPose frame = truth;
    frame.covariance.setZero();
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(1.0 + 1e-4 * static_cast<double>(i), Vector3d::UnitZ()));
    frame.state.q_world_gyro = turn * truth.state.q_world_gyro;
    frame.state.p_world_m = turn * truth.state.p_world_m + Vector3d(1.0, 2.0, 3.0);
    frame.state.v_world_m_s = turn * truth.state.v_world_m_s;
    frames.push_back(frame);
    if (i >= 4 && i % 4 == 0) keyframes.push_back(truth);
  }
  OdometryPose elsewhere = frames.back();  // of a segment without keyframes
  elsewhere.time_ns += 1'000'000'000;
  elsewhere.frame_stamp_ns += 1'000'000'000;
  elsewhere.segment = 1;
  frames.push_back(elsewhere);

  const std::vector<OdometryPose> moved = MoveWithKeyframes(frames, keyframes);
  ASSERT_EQ(moved.size(), frames.size());
  for (size_t i = 0; i < way.truth.size(); ++i) {
    SCOPED_TRACE(i);
    const NavigationState &state = moved[i].state, &truth = way.truth[i].state;
    EXPECT_LT((state.p_world_m - truth.p_world_m).norm(), 2e-3);  // 4 keyframes of 1e-4 rad, 4 m
    EXPECT_LT(state.q_world_gyro.angularDistance(truth.q_world_gyro), 5e-4);
    EXPECT_LT((state.v_world_m_s - truth.v_world_m_s).norm(), 2e-3);
    const double first = 4.0, last = static_cast<double>(keyframes.back().covariance(0, 0));
    EXPECT_NEAR(moved[i].covariance(0, 0), std::clamp(static_cast<double>(i), first, last), 1e-9);
    EXPECT_EQ(moved[i].time_ns, frames[i].time_ns);
  }
  EXPECT_EQ(moved[8].state.p_world_m, way.truth[8].state.p_world_m);  // itself a keyframe
  EXPECT_EQ(moved.back().state.p_world_m, elsewhere.state.p_world_m);
}

TEST(PoseGraph, RefusesLoopsBetweenKeyframesThatAreNotThere) {
  const Way way(6);
  EXPECT_FALSE(CloseLoops(way.odometry, {{5, 5, {}}}));
  EXPECT_FALSE(CloseLoops(way.odometry, {{5, way.odometry.size(), {}}}));
}

}  // namespace
}  // namespace camgyro
