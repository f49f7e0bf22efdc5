// Odometry when the world is not as it should be: rest, darkness, holes, other places.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "core/linear_algebra.h"
#include "core/time.h"
#include "tests/estimator/odometry/walk.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// 0 before, 1 from a second later on, smoothly.
double Step(double time_s, double from_s) {
  const double s = std::clamp(time_s - from_s, 0.0, 1.0);
  return s * s * s * (10.0 + s * (6.0 * s - 15.0));
}

// On foot with a hand that is never still; `walks` and `turns` are the shares of that motion, and
// of that of the hand's rotation, over time.
Walk WalkLike(double duration_s, uint64_t seed, const std::function<double(double)>& walks,
              const std::function<double(double)>& turns) {
  simulation::Scenario scenario = WalkingScenario(duration_s);
  scenario.seed = seed;
  scenario.camera.rate_hz = 20.0;
  scenario.gyro.accel_bias_m_s2 = {0.05, -0.03, 0.04};
  scenario.gyro.accel_bias_walk_m_s3_rtHz = 1e-3;
  scenario.motion.kind = simulation::MotionKind::kFile;
  scenario.motion.file = testing::TempDir() + "camgyro_walk_" + std::to_string(getpid()) + ".tum";
  std::ofstream file(scenario.motion.file);
  file.precision(12);
  constexpr double kRowS = 0.01;
  const double phase = static_cast<double>(seed);
  // The camera's z looks ahead, along the world's y.
  const Eigen::Quaterniond level(Eigen::AngleAxisd(-0.5 * M_PI, Vector3d::UnitX()));
  double way_m = 0.0;
  for (double t = 0.0; t < duration_s + 2.0; t += kRowS) {
    way_m += 1.2 * walks(t) * kRowS;
    const Vector3d hand(0.06 * std::sin(3.1 * t + phase), 0.04 * std::sin(5.3 * t + 2.0 * phase),
                        0.04 * std::sin(11.0 * t));
    const Vector3d turn(0.12 * std::sin(4.1 * t), 0.2 * std::sin(2.3 * t + phase),
                        0.08 * std::sin(6.7 * t + 2.0));
    const Vector3d p = Vector3d(0.3 * way_m, way_m, 0.0) + walks(t) * hand;
    const Eigen::Quaterniond q = level * Exp(Vector3d(turns(t) * turn));
    file << t << ' ' << p.transpose() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' '
         << q.w() << '\n';
  }
  file.close();
  Walk walk = WalkOf(scenario);
  walk.options.walk.accel_m_s3_rtHz = scenario.gyro.accel_bias_walk_m_s3_rtHz;
  std::remove(scenario.motion.file.c_str());
  return walk;
}

double Always(double) { return 1.0; }

// Of any of a thousand poses in a row: three times that is beyond what chance makes of a chi square
// of three degrees of freedom once in a million.
constexpr double kMostNees = 10.0;

double AfterBeginS(const Walk& walk, int64_t time_ns) {
  return SecondsSince(walk.scenario.start_ns, time_ns);
}

// e' C^-1 e / 3: 1 in the mean.
double Nees(const OdometryPose& pose, const Vector3d& error_m) {
  const Matrix3d covariance = pose.covariance.block<3, 3>(kNavPosition, kNavPosition);
  return SquaredMahalanobis(error_m, covariance) / 3.0;
}

double SigmaM(const OdometryPose& pose) {
  return std::sqrt(pose.covariance.block<3, 3>(kNavPosition, kNavPosition).trace());
}

// The truth in the world of a segment.
TruthFrom TruthOf(const Walk& walk, const OdometryRun& run, int segment) {
  const auto first =
      std::find_if(run.keyframes.begin(), run.keyframes.end(),
                   [&](const OdometryPose& pose) { return pose.segment == segment; });
  EXPECT_NE(first, run.keyframes.end());
  return TruthFrom(walk, *first);
}

std::string EventsOf(const Walk& walk, const OdometryRun& run) {
  std::string text;
  for (const OdometryEvent& event : run.events) {
    text += std::to_string(AfterBeginS(walk, event.time_ns)) + " s: " + event.explanation + "; ";
  }
  return text;
}

// Put down on a table for a minute, and taken up again: nothing moves from 9 to 69 s, which is long
// enough for all keyframes from before to have left the window.
TEST(OdometryFaults, StaysWhereItIsWhileAtRest) {
  const auto awake = [](double t) { return std::max(1.0 - Step(t, 8.0), Step(t, 69.0)); };
  Walk walk = WalkLike(75.0, 1, awake, awake);
  walk.options.keyframes = 8;
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  ASSERT_EQ(run->segments, 1) << EventsOf(walk, *run);
  const TruthFrom truth = TruthOf(walk, *run, 0);
  const OdometryPose* begin = nullptr;
  double velocity_nees = 0.0, resting = 0.0;
  for (const OdometryPose& pose : run->poses) {
    const Vector3d error = truth.PositionError(pose);
    EXPECT_LT(Nees(pose, error), kMostNees);
    const double t = AfterBeginS(walk, pose.time_ns);
    if (t < 10.0 || t > 69.0) continue;
    if (begin == nullptr) begin = &pose;
    // What it moves is what pictures of one place leave open, 0.5 px in 650 at some metres.
    EXPECT_LT((pose.state.p_world_m - begin->state.p_world_m).norm(), 0.03);
    EXPECT_LT(SigmaM(pose), 1.5 * SigmaM(*begin));
    const Vector3d& v = pose.state.v_world_m_s;
    EXPECT_LT(v.norm(), 0.04);
    velocity_nees +=
        SquaredMahalanobis(v, pose.covariance.block<3, 3>(kNavVelocity, kNavVelocity)) / 3.0;
    ++resting;
  }
  ASSERT_GT(resting, 1000.0);
  EXPECT_LT(velocity_nees / resting, 2.0);
  EXPECT_GT(run->poses.back().mapped_tracks, 20);
}

// Turning tells nothing of the scale: no start before the first step, and a right one then.
TEST(OdometryFaults, PureRotationAtTheStartIsWaitedFor) {
  const Walk walk = WalkLike(
      14.0, 2, [](double t) { return Step(t, 6.0); }, Always);
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  ASSERT_EQ(run->segments, 1) << EventsOf(walk, *run) << run->start_explanation;
  EXPECT_GT(AfterBeginS(walk, run->events.front().time_ns), 6.0);
  const TruthFrom truth = TruthOf(walk, *run, 0);
  for (const OdometryPose& pose : run->poses) {
    EXPECT_LT(Nees(pose, truth.PositionError(pose)), kMostNees);
  }
  EXPECT_LT(SigmaM(run->poses.back()), 0.3);
}

// Five seconds with the lens in a pocket, carried on all the time.
TEST(OdometryFaults, CarriedOnInTheDark) {
  Walk walk = WalkLike(17.0, 3, Always, Always);
  Recording& r = walk.simulated.recording;
  for (size_t i = 0; i < r.frames.size(); ++i) {
    const double t = AfterBeginS(walk, r.frames[i].stamp_ns);
    if (t > 7.0 && t < 12.0) r.tracks[i].clear();
  }
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  ASSERT_EQ(run->segments, 1) << EventsOf(walk, *run);
  const TruthFrom truth = TruthOf(walk, *run, 0);
  double seen_m = 0.0, dark_m = 0.0;  // sigmas
  for (const OdometryPose& pose : run->poses) {
    EXPECT_LT(Nees(pose, truth.PositionError(pose)), kMostNees);
    double& widest = AfterBeginS(walk, pose.time_ns) < 7.0 ? seen_m : dark_m;
    widest = std::max(widest, SigmaM(pose));
  }
  EXPECT_GT(dark_m, 2.0 * seen_m) << "darkness costs certainty";
  EXPECT_LT(dark_m, 0.5);
  EXPECT_GT(run->poses.back().mapped_tracks, 20) << "the points afterwards are mapped";
}

// Cuts so much out of the recording that the stamps do not show it: all tracks end there, and the
// inertial data jump, too, as if device and stream had been carried elsewhere in no time.
void CutOut(int64_t from_ns, int64_t gone_ns, Recording* r) {
  const auto gone = [&](const auto& sample) {
    return sample.stamp_ns >= from_ns && sample.stamp_ns < from_ns + gone_ns;
  };
  std::vector<std::vector<TrackedPoint>> tracks;
  for (size_t i = 0; i < r->frames.size(); ++i) {
    if (gone(r->frames[i])) continue;
    tracks.push_back(r->tracks[i]);
    if (r->frames[i].stamp_ns < from_ns) continue;
    for (TrackedPoint& point : tracks.back()) point.track_id += 1'000'000;
  }
  r->tracks = std::move(tracks);
  const auto cut = [&](auto* samples) {
    samples->erase(std::remove_if(samples->begin(), samples->end(), gone), samples->end());
    for (auto& sample : *samples) sample.stamp_ns -= sample.stamp_ns >= from_ns ? gone_ns : 0;
  };
  cut(&r->frames);
  cut(&r->gyro);
  cut(&r->accel);
}

// Pictures contradict the motion: it is lost, and what follows claims no place. With seed 8 hardly
// any track agrees with the motion well enough to become a landmark that could contradict it.
TEST(OdometryFaults, ElsewhereFromOneFrameToTheNextIsLostAndClaimsNoPlace) {
  constexpr double kCutS = 7.0;
  constexpr int64_t kGoneNs = 2'500'000'000;
  for (const uint64_t seed : {4, 8}) {
    Walk walk = WalkLike(18.0, seed, Always, Always);
    const int64_t from_ns = StampAt(walk.scenario.start_ns, kCutS);
    CutOut(from_ns, kGoneNs, &walk.simulated.recording);
    const auto run = walk.Follow();
    ASSERT_TRUE(run);
    ASSERT_GE(run->segments, 2) << EventsOf(walk, *run);
    const OdometryEvent& lost = run->events[1];
    EXPECT_EQ(lost.kind, OdometryEvent::Kind::kLost);
    EXPECT_THAT(lost.explanation, testing::HasSubstr("agree with the motion"));
    EXPECT_LT(AfterBeginS(walk, lost.time_ns), kCutS + 2.0);
    const auto as_it_was = [&](OdometryPose pose) {
      pose.time_ns += pose.time_ns > from_ns ? kGoneNs : 0;
      return pose;
    };
    const auto second = std::find_if(run->keyframes.begin(), run->keyframes.end(),
                                     [](const OdometryPose& pose) { return pose.segment == 1; });
    ASSERT_NE(second, run->keyframes.end());
    const TruthFrom before = TruthOf(walk, *run, 0), after(walk, as_it_was(*second));
    for (const OdometryPose& pose : run->poses) {
      if (pose.time_ns > from_ns && pose.segment == 0) continue;  // nobody can know it at once
      EXPECT_LT(Nees(pose, before.PositionError(as_it_was(pose))), kMostNees);
      if (pose.segment == 1) {
        EXPECT_GT(SigmaM(pose), 1e3);
        EXPECT_LT(after.PositionError(as_it_was(pose)).norm(), 0.2) << "the way itself is right";
      }
    }
    EXPECT_EQ(run->poses.back().segment, 1);
  }
}

}  // namespace
}  // namespace camgyro
