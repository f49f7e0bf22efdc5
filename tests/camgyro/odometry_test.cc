// The library's odometry against the estimator inside, and what it answers to bad data.
#include "camgyro/odometry.h"

#include <gmock/gmock.h>

#include <cmath>

#include "estimator/odometry/follow_recording.h"
#include "tests/estimator/vins/vins_scene.h"

namespace camgyro {
namespace {

api::OdometrySettings SettingsFor(const simulation::Scenario& scenario) {
  api::OdometrySettings settings;
  settings.inertial.gyro_noise_rad_s_rtHz = scenario.gyro.noise_density_rad_s_rtHz;
  settings.inertial.accel_noise_m_s2_rtHz = scenario.gyro.accel_noise_density_m_s2_rtHz;
  settings.inertial.p_gyro_cam_m = {0.03, 0.05, 0.0};
  settings.keyframes = 8;
  return settings;
}

// Of a pinhole without effects.
api::Calibration ApiOf(const Calibration& c) {
  api::Calibration api;
  api.width_px = c.width_px;
  api.height_px = c.height_px;
  api.focal_px = c.lens[kFocal];
  api.principal_px = {c.lens[kCx], c.lens[kCy]};
  api.readout_s = c.readout_s;
  api.delay_s = c.delay_s;
  const Eigen::Vector3d& b = c.bias_gyro_rad_s;
  api.bias_gyro_rad_s = {b.x(), b.y(), b.z()};
  const Eigen::Quaterniond& q = c.q_gyro_cam;
  api.q_gyro_cam_wxyz = {q.w(), q.x(), q.y(), q.z()};
  Eigen::Map<StateCovariance>(api.covariance.data()) = c.covariance;
  return api;
}

OdometryOptions OptionsFrom(const api::OdometrySettings& settings) {
  OdometryOptions options;
  options.noise = {settings.inertial.gyro_noise_rad_s_rtHz,
                   settings.inertial.accel_noise_m_s2_rtHz};
  options.p_gyro_cam_m = {0.03, 0.05, 0.0};
  options.keyframes = settings.keyframes;
  return options;
}

TEST(LibraryOdometry, SaysWhatTheEstimatorInsideSays) {
  const simulation::Scenario scenario = WalkingScenario(4.0);
  const auto simulated = simulation::SimulateTracks(scenario, 2);
  ASSERT_TRUE(simulated);
  const Recording& r = simulated->recording;
  const Calibration calibration = GoodCalibration(*simulated);
  const api::OdometrySettings settings = SettingsFor(scenario);

  std::string error;
  const auto odometry = api::Odometry::Create(ApiOf(calibration), settings, &error);
  ASSERT_TRUE(odometry) << error;
  EXPECT_FALSE(odometry->Take().tracking);
  for (const GyroSample& s : r.gyro) {
    const Eigen::Vector3d& w = s.omega_gyro_rad_s;
    ASSERT_EQ(odometry->AddGyro(s.stamp_ns, w.x(), w.y(), w.z()), api::AddResult::kAccepted);
  }
  for (const AccelSample& s : r.accel) {
    const Eigen::Vector3d& a = s.accel_gyro_m_s2;
    ASSERT_EQ(odometry->AddAccel(s.stamp_ns, a.x(), a.y(), a.z()), api::AddResult::kAccepted);
  }
  for (size_t i = 0; i < r.frames.size(); ++i) {
    std::vector<api::TrackPoint> points;
    for (const TrackedPoint& p : r.tracks[i]) points.push_back({p.track_id, p.px.x(), p.px.y()});
    ASSERT_EQ(odometry->AddTracks(r.frames[i].stamp_ns, points.data(), points.size()),
              api::AddResult::kAccepted);
  }
  const api::OdometryUpdate update = odometry->Take();
  ASSERT_TRUE(update.tracking) << update.message;
  ASSERT_EQ(update.events.size(), 1u);
  EXPECT_TRUE(update.events.front().started);

  const auto inside = FollowRecording(r, calibration, OptionsFrom(settings), nullptr);
  ASSERT_TRUE(inside);
  ASSERT_GT(inside->poses.size(), 20u);
  ASSERT_GE(update.poses.size(), inside->poses.size());
  for (size_t i = 0; i < inside->poses.size(); ++i) {
    EXPECT_EQ(update.poses[i].p_world_m[0], inside->poses[i].state.p_world_m.x());
    EXPECT_EQ(update.poses[i].covariance[48], inside->poses[i].covariance(3, 3));
  }
  EXPECT_TRUE(odometry->Take().poses.empty());
  odometry->Finish();
  EXPECT_FALSE(odometry->Take().keyframes.empty());
  EXPECT_NEAR(odometry->calibration().delay_s, simulated->truth.delay_s, 5e-4);
}

TEST(LibraryOdometry, AnswersToBadData) {
  const simulation::Scenario scenario = WalkingScenario(1.0);
  const auto simulated = simulation::SimulateSensors(scenario);
  ASSERT_TRUE(simulated);
  const api::Calibration calibration = ApiOf(GoodCalibration(*simulated));
  const auto odometry = api::Odometry::Create(calibration, {}, nullptr);
  ASSERT_TRUE(odometry);
  EXPECT_EQ(odometry->AddGyro(1000, 0.0, 0.0, 0.0), api::AddResult::kAccepted);
  EXPECT_EQ(odometry->AddGyro(1000, 0.0, 0.0, 0.0), api::AddResult::kDuplicate);
  EXPECT_EQ(odometry->AddGyro(900, 0.0, 0.0, 0.0), api::AddResult::kOutOfOrder);
  EXPECT_EQ(odometry->AddGyro(2000, std::nan(""), 0.0, 0.0), api::AddResult::kNotFinite);
  EXPECT_EQ(odometry->AddAccel(1000, 1e9, 0.0, 0.0), api::AddResult::kOutOfRange);
  const api::TrackPoint far{1, 1e6, 0.0};
  EXPECT_EQ(odometry->AddTracks(1000, &far, 1), api::AddResult::kOutOfRange);

  std::string error;
  api::OdometrySettings settings;
  settings.keyframes = 2;
  EXPECT_FALSE(api::Odometry::Create(calibration, settings, &error));
  EXPECT_THAT(error, testing::HasSubstr("keyframes"));
  api::Calibration broken = calibration;
  broken.focal_px = std::nan("");
  EXPECT_FALSE(api::Odometry::Create(broken, {}, &error));
  EXPECT_THAT(error, testing::HasSubstr("focal length"));
  broken = calibration;
  broken.covariance[0] = std::nan("");
  EXPECT_FALSE(api::Odometry::Create(broken, {}, &error));
  EXPECT_THAT(error, testing::HasSubstr("covariance"));
  broken = calibration;
  broken.column_readout_s = 0.03;
  EXPECT_FALSE(api::Odometry::Create(broken, {}, &error));
  EXPECT_THAT(error, testing::HasSubstr("read column by column"));
}

}  // namespace
}  // namespace camgyro
