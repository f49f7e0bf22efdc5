// The track level against projections written here from the conventions of
// docs/architecture.md.
#include "simulation/simulate.h"

#include <gmock/gmock.h>

#include <cmath>
#include <map>

#include "core/so3.h"
#include "core/time.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Scenario Noiseless() {
  Scenario scenario;
  scenario.duration_s = 3.0;
  scenario.tracks.noise_px = 0.0;
  scenario.gyro.noise_density_rad_s_rtHz = 0.0;
  scenario.gyro.bias_walk_rad_s2_rtHz = 0.0;
  return scenario;
}

// Largest distance [px] between the tracks and their points projected with the truth: fx = fy = f,
// t_gyro = t_i + t_d + t_r v / h with the row v of the track itself.
double LargestProjectionError(const Simulated& s) {
  const Calibration& truth = s.truth;
  double largest = 0.0;
  for (size_t i = 0; i < s.recording.tracks.size(); ++i) {
    const double stamp_s = 1e-9 * static_cast<double>(s.recording.frames[i].stamp_ns -
                                                      s.recording.gyro.front().stamp_ns);
    for (size_t k = 0; k < s.recording.tracks[i].size(); ++k) {
      const Vector2d px = s.recording.tracks[i][k].px;
      const double t = stamp_s + truth.delay_s + truth.readout_s * px.y() / truth.height_px;
      const CameraState camera = s.camera->trajectory().At(t);
      const Vector3d p =
          camera.R_world_cam.transpose() * (s.points[i][k].world_m - camera.p_world_m);
      const double f = truth.lens[kFocal];
      const Vector2d expected(f * p.x() / p.z() + truth.lens[kCx],
                              f * p.y() / p.z() + truth.lens[kCy]);
      largest = std::max(largest, (px - expected).norm());
    }
  }
  return largest;
}

TEST(Tracks, AreProjectionsOfStaticPointsAtTheirRowsTime) {
  for (const double readout_s : {0.0, 0.03, -0.03}) {
    SCOPED_TRACE(readout_s);
    Scenario scenario = Noiseless();
    scenario.camera.readout_s = readout_s;
    scenario.camera.delay_s = -0.021;
    scenario.camera.principal_px = Vector2d(371.0, 228.0);
    scenario.motion = MotionPreset(MotionKind::kRunning);
    const Simulated s = SimulateTracks(scenario).value();
    EXPECT_LT(LargestProjectionError(s), 1e-6);
    // And each landmark stays where it is.
    std::map<int64_t, Vector3d> where;
    size_t observations = 0;
    for (size_t i = 0; i < s.points.size(); ++i) {
      for (size_t k = 0; k < s.points[i].size(); ++k, ++observations) {
        const auto [it, is_new] =
            where.emplace(s.recording.tracks[i][k].track_id, s.points[i][k].world_m);
        if (!is_new) {
          EXPECT_EQ(it->second, s.points[i][k].world_m);
        }
      }
    }
    EXPECT_GT(observations, 2 * where.size());
  }
}

// The two-view constraint with nothing but the gyro: integrate the recorded rates with the true
// bias, de-rotate the rays, and the translation of the known trajectory must lie in their plane.
TEST(Tracks, AgreeWithTheGyroThroughTheDefinitions) {
  Scenario scenario = Noiseless();
  scenario.gyro.rate_hz = 2000.0;  // so that the integration below errs little
  const Simulated s = SimulateTracks(scenario).value();
  const Calibration& truth = s.truth;
  const Matrix3d R_gyro_cam = truth.q_gyro_cam.toRotationMatrix();
  std::vector<Matrix3d> R_start_gyro = {Matrix3d::Identity()};
  const auto& gyro = s.recording.gyro;
  const auto rate = [&](size_t i) -> Vector3d {
    return gyro[i].omega_gyro_rad_s - truth.bias_gyro_rad_s;
  };
  for (size_t i = 1; i < gyro.size(); ++i) {
    const Vector3d turn = 0.5 * (rate(i - 1) + rate(i)) * 5e-4;
    R_start_gyro.push_back(R_start_gyro.back() * Exp(turn).toRotationMatrix());
  }
  const auto ray = [&](const Vector2d& px, double t) -> Vector3d {
    const Vector3d cam((px.x() - truth.lens[kCx]) / truth.lens[kFocal],
                       (px.y() - truth.lens[kCy]) / truth.lens[kFocal], 1.0);
    const double position = t / 5e-4;
    const auto i = static_cast<size_t>(position);
    const Vector3d rest = rate(i) * (t - static_cast<double>(i) * 5e-4);
    return R_start_gyro[i] * Exp(rest).toRotationMatrix() * R_gyro_cam * cam.normalized();
  };
  const auto time = [&](size_t frame, const Vector2d& px) {
    return SecondsSince(gyro.front().stamp_ns, s.recording.frames[frame].stamp_ns) + truth.delay_s +
           truth.readout_s * px.y() / truth.height_px;
  };
  const Matrix3d R_start_world =
      R_gyro_cam * s.camera->trajectory().At(0.0).R_world_cam.transpose();
  int checked = 0;
  for (const FramePair& pair : PairsFromTracks(s.recording.tracks, 3)) {
    for (const Match& match : pair.matches) {
      const double t_a = time(static_cast<size_t>(pair.frame_a), match.px_a);
      const double t_b = time(static_cast<size_t>(pair.frame_b), match.px_b);
      const Vector3d step_world =
          s.camera->trajectory().At(t_b).p_world_m - s.camera->trajectory().At(t_a).p_world_m;
      const Vector3d normal = ray(match.px_a, t_a).cross(ray(match.px_b, t_b));
      EXPECT_LT(std::abs(normal.dot(R_start_world * step_world.normalized())), 2e-6);
      ++checked;
    }
  }
  EXPECT_GT(checked, 3000);
}

TEST(Tracks, NoiseHasTheSizeThatWasAsked) {
  Scenario scenario;
  scenario.tracks.noise_px = 0.7;
  const Simulated s = SimulateTracks(scenario).value();
  EXPECT_EQ(s.recording.match_noise, MatchNoise::kBothImages);
  double sum = 0.0, next_sum = 0.0;
  size_t count = 0;
  Vector2d previous = Vector2d::Zero();
  for (size_t i = 0; i < s.points.size(); ++i) {
    ASSERT_EQ(s.points[i].size(), s.recording.tracks[i].size());
    EXPECT_EQ(s.points[i].size(), 100u);
    for (size_t k = 0; k < s.points[i].size(); ++k, ++count) {
      const Vector2d error = s.recording.tracks[i][k].px - s.points[i][k].px;
      sum += 0.5 * error.squaredNorm();
      next_sum += 0.5 * error.dot(previous);
      previous = error;
    }
  }
  EXPECT_NEAR(std::sqrt(sum / count), 0.7, 0.01);
  EXPECT_NEAR(next_sum / count, 0.0, 0.01);
}

// How far off a re-anchored track is between two frames, but for the noise of the second [px].
struct ReanchoredErrors {
  double largest_px = 0.0, rms_of_noise_px = 0.0;
  int count = 0;
};

ReanchoredErrors ErrorsOfReanchored(const Simulated& s) {
  ReanchoredErrors errors;
  double sum = 0.0;
  for (size_t i = 1; i < s.points.size(); ++i) {
    std::map<int64_t, Vector2d> before;
    for (const TrackedPoint& point : s.recording.tracks[i - 1]) before[point.track_id] = point.px;
    const FrameTiming& timing = s.frames[i - 1].timing;
    for (size_t k = 0; k < s.points[i].size(); ++k) {
      const TrackedPoint& point = s.recording.tracks[i][k];
      if (before.count(point.track_id) == 0) continue;
      // What was found without noise here is what was measured, with noise, in the frame before.
      const Vector3d world_m = s.points[i][k].world_m;
      const auto seen = s.camera->Observe(timing, [&](double) { return world_m; });
      if (!seen) continue;
      errors.largest_px =
          std::max(errors.largest_px, (seen->sensor_px - before[point.track_id]).norm());
      sum += 0.5 * (point.px - s.points[i][k].px).squaredNorm();
      ++errors.count;
    }
  }
  errors.rms_of_noise_px = std::sqrt(sum / errors.count);
  return errors;
}

// A re-anchored track is exact between two frames but for the noise of the second, and walks over
// many: its landmark changes at every frame.
TEST(Tracks, ReanchoredNoiseSitsInTheSecondImage) {
  Scenario scenario;
  scenario.tracks.noise_px = 0.5;
  scenario.tracks.reanchored = true;
  const Simulated s = SimulateTracks(scenario).value();
  EXPECT_EQ(s.recording.match_noise, MatchNoise::kSecondImage);
  const ReanchoredErrors errors = ErrorsOfReanchored(s);
  ASSERT_GT(errors.count, 10000);
  EXPECT_LT(errors.largest_px, 1e-6);
  EXPECT_NEAR(errors.rms_of_noise_px, 0.5, 0.01);
}

// A tracker holds blurred pictures against blurred ones: what blur shifts is in both, and does not
// add up from frame to frame.
TEST(Tracks, ReanchoredPointsAreAveragedOnce) {
  Scenario scenario;
  scenario.tracks.noise_px = 0.5;
  scenario.tracks.reanchored = true;
  scenario.camera.exposure_s = 0.02;
  scenario.effects.exposure_lowpass.factor = 1.0;
  const ReanchoredErrors errors = ErrorsOfReanchored(SimulateTracks(scenario).value());
  ASSERT_GT(errors.count, 10000);
  EXPECT_LT(errors.largest_px, 0.02);
}

// As of pictures that are blurred and dark for a while.
TEST(Tracks, NoiseScattersFromFrameToFrame) {
  Scenario scenario;
  scenario.duration_s = 40.0;
  scenario.tracks.count = 200;
  scenario.tracks.noise_px = 0.5;
  scenario.tracks.noise_scatter = 0.4;
  const Simulated s = SimulateTracks(scenario).value();
  std::vector<double> logs;
  for (size_t i = 0; i < s.points.size(); ++i) {
    double sum = 0.0;
    for (size_t k = 0; k < s.points[i].size(); ++k) {
      sum += (s.recording.tracks[i][k].px - s.points[i][k].px).squaredNorm();
    }
    logs.push_back(0.5 * std::log(0.5 * sum / static_cast<double>(s.points[i].size())));
  }
  double mean = 0.0, square = 0.0, neighbours = 0.0;
  for (const double log : logs) mean += log / static_cast<double>(logs.size());
  for (size_t i = 1; i < logs.size(); ++i) {
    square += (logs[i] - mean) * (logs[i] - mean);
    neighbours += (logs[i] - mean) * (logs[i - 1] - mean);
  }
  EXPECT_NEAR(std::exp(mean), 0.5, 0.05);
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(logs.size())), 0.4, 0.05);
  EXPECT_NEAR(neighbours / square, std::exp(-1.0 / (30.0 * TrackOptions::kNoiseMemoryS)), 0.05);
}

TEST(Tracks, OutliersMovingPointsAndLifeAreAsAsked) {
  Scenario scenario;
  scenario.duration_s = 20.0;
  scenario.tracks.outlier_fraction = 0.05;
  scenario.scene.moving_fraction = 0.1;
  scenario.tracks.mean_life_frames = 5.0;
  const Simulated s = SimulateTracks(scenario).value();
  int outliers = 0, moving = 0, count = 0;
  std::map<int64_t, int> life;
  for (size_t i = 0; i < s.points.size(); ++i) {
    for (size_t k = 0; k < s.points[i].size(); ++k, ++count) {
      outliers += s.points[i][k].outlier;
      moving += s.points[i][k].moving;
      ++life[s.recording.tracks[i][k].track_id];
    }
  }
  EXPECT_NEAR(1.0 * outliers / count, 0.05, 0.005);
  EXPECT_NEAR(1.0 * moving / count, 0.1, 0.02);
  const double mean_life = 1.0 * count / static_cast<double>(life.size());
  EXPECT_LT(mean_life, 5.0);  // some leave the picture before
  EXPECT_GT(mean_life, 3.5);
}

TEST(Tracks, StructuredScenesHaveTheirDepths) {
  for (const SceneKind kind :
       {SceneKind::kGround, SceneKind::kRoom, SceneKind::kFacade, SceneKind::kMountains}) {
    SCOPED_TRACE(static_cast<int>(kind));
    Scenario scenario = Noiseless();
    scenario.scene.kind = kind;
    scenario.scene.moving_objects = 3;
    scenario.motion.path_radius_m = 1.0;
    const Simulated s = SimulateTracks(scenario).value();
    std::vector<double> depth;
    int moving = 0;
    for (size_t i = 0; i < s.points.size(); ++i) {
      EXPECT_GT(s.points[i].size(), 90u);
      for (const PointTruth& point : s.points[i]) {
        const CameraState camera = s.camera->trajectory().At(point.time_s);
        depth.push_back((camera.R_world_cam.transpose() * (point.world_m - camera.p_world_m)).z());
        if (kind == SceneKind::kRoom) {
          const Vector3d outside = point.world_m.cwiseAbs() - 0.5 * scenario.scene.room_m;
          EXPECT_LT(outside.maxCoeff(), point.moving ? 10.0 : 1e-9);
        }
        moving += point.moving;
      }
    }
    EXPECT_LT(LargestProjectionError(s), 1e-6);
    EXPECT_GT(moving, 0);
    std::sort(depth.begin(), depth.end());
    // Half of the picture over flat ground is sky, as far as the mountains.
    const double quartile = depth[depth.size() / 4];
    if (kind == SceneKind::kMountains) {
      EXPECT_GT(quartile, 100.0);
    } else {
      EXPECT_LT(quartile, 10.0);
    }
  }
}

TEST(Tracks, CameraMustStayInItsRoom) {
  Scenario scenario = Noiseless();
  scenario.scene.kind = SceneKind::kRoom;
  scenario.duration_s = 30.0;
  const auto result = SimulateTracks(scenario);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, testing::HasSubstr("leaves the room"));
}

// Points of a corridor lie between the walls of the room and those of the block, and a walk into
// the block is refused.
TEST(Tracks, CorridorGoesRoundABlock) {
  Scenario scenario = Noiseless();
  scenario.duration_s = 4.0;
  scenario.scene.kind = SceneKind::kCorridor;
  scenario.scene.room_m = {9.0, 3.0, 9.0};
  scenario.motion.path_radius_m = 3.0;
  const Simulated s = SimulateTracks(scenario).value();
  const Vector3d half = 0.5 * scenario.scene.room_m;
  for (const auto& points : s.points) {
    for (const PointTruth& point : points) {
      EXPECT_LT((point.world_m.cwiseAbs() - half).maxCoeff(), 1e-9);
      const bool in_block = std::abs(point.world_m.x()) < 0.5 * scenario.scene.block_m[0] - 0.03 &&
                            std::abs(point.world_m.z()) < 0.5 * scenario.scene.block_m[1] - 0.03;
      EXPECT_FALSE(in_block && std::abs(point.world_m.y()) < half.y() - 1e-9);
    }
  }
  scenario.motion.path_radius_m = 1.5;
  const auto result = SimulateTracks(scenario);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, testing::HasSubstr("runs into the block"));
}

TEST(Tracks, SameSeedSameRecordingOtherSeedAnother) {
  const Simulated a = SimulateTracks(Scenario(), 5).value();
  const Simulated b = SimulateTracks(Scenario(), 5).value();
  const Simulated c = SimulateTracks(Scenario(), 6).value();
  ASSERT_EQ(a.recording.gyro.size(), b.recording.gyro.size());
  for (size_t i = 0; i < a.recording.gyro.size(); ++i) {
    EXPECT_EQ(a.recording.gyro[i].omega_gyro_rad_s, b.recording.gyro[i].omega_gyro_rad_s);
  }
  for (size_t i = 0; i < a.recording.tracks.size(); ++i) {
    ASSERT_EQ(a.recording.tracks[i].size(), b.recording.tracks[i].size());
    for (size_t k = 0; k < a.recording.tracks[i].size(); ++k) {
      EXPECT_EQ(a.recording.tracks[i][k].px, b.recording.tracks[i][k].px);
    }
  }
  EXPECT_NE(a.recording.gyro[9].omega_gyro_rad_s, c.recording.gyro[9].omega_gyro_rad_s);
}

// Turned by an error of the camera's own axes: noise, and what the effect makes of the rate.
TEST(Attitudes, AreTheCamerasWithNoise) {
  Scenario scenario;
  scenario.duration_s = 60.0;
  scenario.attitudes.noise_rad = 0.002;
  for (const bool with_effect : {false, true}) {
    if (with_effect) scenario.effects.attitude_rolling_shutter = {-0.008, 0.006};
    const Simulated s = SimulateTracks(scenario).value();
    EXPECT_TRUE(s.recording.HasOnlyAttitudes());
    EXPECT_EQ(s.truth.readout_s, 0.0);
    ASSERT_EQ(s.recording.q_cam_world.size(), s.frames.size());
    Vector3d squares = Vector3d::Zero();
    for (size_t i = 0; i < s.frames.size(); ++i) {
      const CameraState& state = s.frames[i].state;
      const Eigen::Quaterniond q_world_cam(state.R_world_cam);
      Vector3d error = Log((s.recording.q_cam_world[i] * q_world_cam).conjugate());
      if (with_effect) {
        error -=
            Vector3d(0.0, 0.006 * state.omega_cam_rad_s.z(), -0.008 * state.omega_cam_rad_s.y());
      }
      squares += error.cwiseAbs2() / static_cast<double>(s.frames.size());
    }
    // The standard deviation of a variance of 1801 numbers is a thirtieth of it.
    EXPECT_LT((squares / 4e-6 - Vector3d::Ones()).cwiseAbs().maxCoeff(), 0.1);
  }
}

// What adds up: from one to the next as much as was asked for, and after n frames sqrt(n) of it.
TEST(Attitudes, MayWalkAway) {
  Scenario scenario;
  scenario.duration_s = 60.0;
  scenario.attitudes.walk_rad = 0.001;
  const Simulated s = SimulateTracks(scenario).value();
  std::vector<Eigen::Quaterniond> error;
  for (size_t i = 0; i < s.frames.size(); ++i) {
    const Eigen::Quaterniond q_world_cam(s.frames[i].state.R_world_cam);
    error.push_back((q_world_cam * s.recording.q_cam_world[i]).conjugate());
  }
  double squares = 0.0;
  for (size_t i = 1; i < error.size(); ++i) {
    squares += Log(error[i - 1].conjugate() * error[i]).squaredNorm();
  }
  EXPECT_NEAR(squares / (3.0 * static_cast<double>(error.size() - 1)), 1e-6, 1e-7);
  const double far = Log(error.front().conjugate() * error.back()).norm();
  EXPECT_GT(far, 0.01);  // sqrt(3 * 1800) mrad is 0.07
  EXPECT_LT(far, 0.2);
}

}  // namespace
}  // namespace camgyro::simulation
