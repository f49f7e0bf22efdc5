// Odometry on simulated walks: where it says the device was, how sure it is, and what it does when
// the data fail.
#include "estimator/odometry/odometry.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"
#include "core/time.h"
#include "tests/estimator/odometry/walk.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

TEST(Odometry, FollowsAWalk) {
  const Walk walk = WalkFor(8.0);
  const auto run = walk.Follow();
  ASSERT_TRUE(run) << run.error().message;
  ASSERT_EQ(run->segments, 1) << run->start_explanation;
  ASSERT_EQ(run->events.size(), 1u);
  ASSERT_GT(run->poses.size(), 120u);
  ASSERT_GT(run->keyframes.size(), 20u);
  EXPECT_NEAR(run->noise_px, 0.5, 0.08);
  const TruthFrom truth(walk, run->keyframes.front());
  EXPECT_LT(Largest(run->poses, truth), 0.15);
  EXPECT_LT(Largest(run->keyframes, truth), 0.1);
  EXPECT_GT(run->path_m, 6.0);
  EXPECT_GT(run->points.size(), 100u);
  for (const OdometryPose& pose : run->poses) {
    EXPECT_LT(truth.VelocityError(pose).norm(), 0.15);
    EXPECT_LT(truth.RotationError(pose).norm(), 0.02);
  }
}

// e' C^-1 e of the last pose over several walks: its mean is 1 per degree of freedom.
TEST(Odometry, CovarianceIsHonest) {
  double position = 0.0, velocity = 0.0, tilt = 0.0, focal = 0.0;
  constexpr int kWalks = 6;
  for (int seed = 1; seed <= kWalks; ++seed) {
    Walk walk = WalkFor(10.0, static_cast<uint64_t>(seed));
    walk.calibration.covariance(kStateFocal, kStateFocal) = 25.0;  // hardly known: it is found
    const auto run = walk.Follow();
    ASSERT_TRUE(run);
    ASSERT_EQ(run->segments, 1) << run->start_explanation;
    const double focal_error_px = run->calibration.lens[kFocal] - walk.calibration.lens[kFocal];
    focal += focal_error_px / run->calibration.sigma()[kStateFocal] / kWalks;
    const TruthFrom truth(walk, run->keyframes.front());
    const OdometryPose& last = run->poses.back();
    const auto squared = [&](const Vector3d& e, int row) {
      return SquaredMahalanobis(e, last.covariance.block<3, 3>(row, row)) / 3.0;
    };
    position += squared(truth.PositionError(last), kNavPosition) / kWalks;
    velocity += squared(truth.VelocityError(last), kNavVelocity) / kWalks;
    tilt += squared(truth.RotationError(last), kNavRotation) / kWalks;
  }
  // 18 degrees of freedom each: 95 % of their means lie within 0.46 and 1.75.
  EXPECT_GT(position, 0.3);
  EXPECT_LT(position, 2.0);
  EXPECT_GT(velocity, 0.3);
  EXPECT_LT(velocity, 2.0);
  EXPECT_GT(tilt, 0.3);
  EXPECT_LT(tilt, 2.0);
  // The mean of six has a sigma of 0.41. With residuals that are not in pixels it is 1.05, which is
  // a focal length that is too long.
  EXPECT_LT(std::abs(focal), 0.82);
}

// A tracker that re-anchors at every frame adds up its noise along each track. It is found, and the
// sigmas know it: taken for independent, e' C^-1 e of the rotation is three times too large.
TEST(Odometry, TracksThatDriftAreFoundAndSigmasStayHonest) {
  double rotation = 0.0, velocity = 0.0;
  constexpr int kWalks = 3;
  for (int seed = 1; seed <= kWalks; ++seed) {
    simulation::Scenario scenario = WalkingScenario(10.0);
    scenario.seed = static_cast<uint64_t>(seed);
    scenario.tracks.reanchored = true;
    const Walk walk = WalkOf(scenario);
    const auto run = walk.Follow();
    ASSERT_TRUE(run);
    ASSERT_EQ(run->segments, 1) << run->start_explanation;
    EXPECT_TRUE(run->tracks_drift);
    EXPECT_NEAR(run->noise_px, 0.5, 0.08);  // of a step
    const TruthFrom truth(walk, run->keyframes.front());
    const auto poses = static_cast<double>(run->poses.size());
    for (const OdometryPose& pose : run->poses) {
      const auto squared = [&](const Vector3d& e, int row) {
        return SquaredMahalanobis(e, pose.covariance.block<3, 3>(row, row)) / 3.0 / poses / kWalks;
      };
      rotation += squared(truth.RotationError(pose), kNavRotation);
      velocity += squared(truth.VelocityError(pose), kNavVelocity);
    }
  }
  EXPECT_LT(rotation, 1.5);
  EXPECT_LT(velocity, 1.5);
  const auto independent = WalkFor(4.0).Follow();
  ASSERT_TRUE(independent);
  EXPECT_FALSE(independent->tracks_drift);
}

// Round a heap of points, which stay in sight: what is kept of them holds the position.
TEST(Odometry, KeepsLandmarksThatStayInSight) {
  const auto squared_error = [](int kept_landmarks, double* nees) {
    double sum = 0.0;
    constexpr int kWalks = 3;
    for (int seed = 1; seed <= kWalks; ++seed) {
      simulation::Scenario scenario = WalkingScenario(25.0);
      scenario.motion.heading_deg = -90.0;  // it looks at the centre
      scenario.motion.path_radius_m = 3.0;
      scenario.motion.speed_m_s = 0.8;
      scenario.seed = static_cast<uint64_t>(seed);
      Walk walk = WalkOf(scenario);
      walk.options.kept_landmarks = kept_landmarks;
      const auto run = walk.Follow();
      EXPECT_TRUE(run && run->segments == 1);
      const TruthFrom truth(walk, run->keyframes.front());
      for (const OdometryPose& pose : run->poses) {
        const Vector3d e = truth.PositionError(pose);
        sum += e.squaredNorm() / static_cast<double>(run->poses.size()) / kWalks;
      }
      const OdometryPose& last = run->poses.back();
      const Vector3d e = truth.PositionError(last);
      *nees += SquaredMahalanobis(e, last.covariance.block<3, 3>(kNavPosition, kNavPosition)) /
               3.0 / kWalks;
    }
    return sum;
  };
  double nees_split = 0.0, nees_kept = 0.0;
  const double split = squared_error(0, &nees_split), kept = squared_error(80, &nees_kept);
  EXPECT_LT(kept, 0.5 * split);
  EXPECT_LT(nees_kept, 2.5);  // 9 degrees of freedom: 99 % of means are below 2.4
}

TEST(Odometry, RefinesTheDelayWithinItsPrior) {
  Walk walk = WalkFor(10.0);
  walk.calibration.delay_s += 2e-3;
  walk.calibration.covariance(kStateDelay, kStateDelay) = 4e-6;
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  ASSERT_EQ(run->segments, 1) << run->start_explanation;
  const double sigma_s = run->calibration.sigma()[kStateDelay];
  EXPECT_LT(sigma_s, 3e-4);
  EXPECT_NEAR(run->calibration.delay_s, walk.simulated.truth.delay_s, 4.0 * sigma_s);
}

TEST(Odometry, InterleavingOfTheStreamsDoesNotMatter) {
  const Walk walk = WalkFor(5.0);
  const Recording& r = walk.simulated.recording;
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  // All frames first, then all rates, then all forces.
  Odometry odometry(walk.calibration, walk.options);
  for (size_t i = 0; i < r.frames.size(); ++i) {
    ASSERT_TRUE(odometry.AddFrame(r.frames[i].stamp_ns, r.tracks[i]));
  }
  for (const GyroSample& sample : r.gyro) ASSERT_TRUE(odometry.AddGyro(sample));
  for (const AccelSample& sample : r.accel) ASSERT_TRUE(odometry.AddAccel(sample));
  const std::vector<OdometryPose> poses = odometry.TakePoses();
  ASSERT_GE(poses.size(), run->poses.size());
  ASSERT_GT(run->poses.size(), 30u);
  for (size_t i = 0; i < run->poses.size(); ++i) {
    EXPECT_EQ(poses[i].state.p_world_m, run->poses[i].state.p_world_m);
  }
}

TEST(Odometry, DarknessIsBridgedWithHonestSigmas) {
  Walk walk = WalkFor(14.0);
  Recording& r = walk.simulated.recording;
  const int64_t begin_ns = r.frames.front().stamp_ns;
  for (size_t i = 0; i < r.frames.size(); ++i) {
    const double time_s = SecondsSince(begin_ns, r.frames[i].stamp_ns);
    if (time_s > 6.0 && time_s < 9.0) r.tracks[i].clear();
  }
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  const TruthFrom truth(walk, run->keyframes.front());
  double widest = 0.0;
  for (const OdometryPose& pose : run->poses) {
    const Vector3d error = truth.PositionError(pose);
    const Eigen::Matrix3d covariance = pose.covariance.block<3, 3>(kNavPosition, kNavPosition);
    widest = std::max(widest, std::sqrt(covariance.trace()));
    EXPECT_LT(SquaredMahalanobis(error, covariance), 30.0);
  }
  EXPECT_GT(widest, 0.02);
  EXPECT_LT(Largest(run->poses, truth), 0.5);
  EXPECT_GT(run->poses.back().mapped_tracks, 20) << "the points afterwards are mapped";
}

TEST(Odometry, AHoleInTheGyroBeginsANewSegmentThatClaimsNoPlace) {
  Walk walk = WalkFor(14.0);
  Recording& r = walk.simulated.recording;
  const int64_t begin_ns = r.gyro.front().stamp_ns;
  const auto in_hole = [&](const GyroSample& sample) {
    const double time_s = SecondsSince(begin_ns, sample.stamp_ns);
    return time_s > 6.0 && time_s < 7.0;
  };
  r.gyro.erase(std::remove_if(r.gyro.begin(), r.gyro.end(), in_hole), r.gyro.end());
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  std::string events;
  for (const OdometryEvent& event : run->events) {
    events +=
        std::to_string(SecondsSince(begin_ns, event.time_ns)) + " s: " + event.explanation + "; ";
  }
  ASSERT_EQ(run->segments, 2) << events;
  ASSERT_EQ(run->events.size(), 3u);
  EXPECT_EQ(run->events[1].kind, OdometryEvent::Kind::kLost);
  EXPECT_THAT(run->events[1].explanation, testing::HasSubstr("hole"));
  const OdometryPose& last = run->poses.back();
  EXPECT_EQ(last.segment, 1);
  const Eigen::Matrix3d place = last.covariance.block<3, 3>(kNavPosition, kNavPosition);
  EXPECT_GT(place.trace(), 1e4);
  // Within the new segment the way is right.
  const auto second = std::find_if(run->keyframes.begin(), run->keyframes.end(),
                                   [](const OdometryPose& pose) { return pose.segment == 1; });
  ASSERT_NE(second, run->keyframes.end());
  const TruthFrom truth(walk, *second);
  EXPECT_LT(truth.PositionError(last).norm(), 0.15);
}

TEST(Odometry, ACameraThatStopsIsFoundAgain) {
  Walk walk = WalkFor(14.0);
  Recording& r = walk.simulated.recording;
  const int64_t begin_ns = r.frames.front().stamp_ns;
  std::vector<int> left_out;
  for (size_t i = 0; i < r.frames.size(); ++i) {
    const double time_s = SecondsSince(begin_ns, r.frames[i].stamp_ns);
    if (time_s > 6.0 && time_s < 9.0) left_out.push_back(static_cast<int>(i));
  }
  LeaveOutFrames(left_out, /*repeats=*/false, &r);
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  ASSERT_GE(run->segments, 1);
  const TruthFrom truth(walk, run->keyframes.front());
  EXPECT_LT(truth.PositionError(run->poses.back()).norm(), 0.6);
  EXPECT_NEAR(SecondsSince(begin_ns, run->poses.back().frame_stamp_ns), 14.0, 0.2);
}

TEST(Odometry, SaysWhyItDoesNotStart) {
  Walk walk = WalkFor(6.0);
  Recording& r = walk.simulated.recording;
  for (AccelSample& sample : r.accel) sample.accel_gyro_m_s2 *= 0.1;  // in another unit
  const auto run = walk.Follow();
  ASSERT_TRUE(run);
  EXPECT_EQ(run->segments, 0);
  EXPECT_TRUE(run->poses.empty());
  EXPECT_EQ(run->start_verdict, VinsVerdict::kAccelerometerImplausible);
  r.accel.clear();
  const auto without = walk.Follow();
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(without.error().message, testing::HasSubstr("accelerometer"));
}

TEST(Odometry, RefusesWhatIsNotInOrderOrNotFinite) {
  const Walk walk = WalkFor(1.0);
  Odometry odometry(walk.calibration, walk.options);
  ASSERT_TRUE(odometry.AddGyro({1000, Vector3d::Zero()}));
  EXPECT_FALSE(odometry.AddGyro({1000, Vector3d::Zero()}));
  EXPECT_FALSE(odometry.AddGyro({2000, Vector3d::Constant(std::nan(""))}));
  ASSERT_TRUE(odometry.AddAccel({1000, Vector3d::Zero()}));
  EXPECT_FALSE(odometry.AddAccel({900, Vector3d::Zero()}));
  ASSERT_TRUE(odometry.AddFrame(1000, {}));
  EXPECT_FALSE(odometry.AddFrame(1000, {}));
}

}  // namespace
}  // namespace camgyro
