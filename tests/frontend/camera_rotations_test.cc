#include "frontend/camera_rotations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/robust_statistics.h"
#include "core/so3.h"
#include "frontend/gyro_rotation.h"
#include "simulation/simulate.h"
#include "tests/frontend/two_view_scene.h"

namespace camgyro {
namespace {

Recording Pictures() {
  Recording recording;
  recording.camera.width_px = 640;
  recording.camera.height_px = 480;
  return recording;
}

// Of rotations between middle rows, against what the gyro says with the true calibration [rad].
double RmsError(const std::vector<CameraRotation>& rotations, const simulation::Simulated& s) {
  double sum = 0.0;
  int count = 0;
  for (const CameraRotation& rotation : rotations) {
    const auto stamp_ns = [&](int frame) {
      return s.recording.frames[static_cast<size_t>(frame)].stamp_ns;
    };
    const auto between = GyroRotation::Between(
        s.recording.gyro, s.truth, stamp_ns(rotation.frame_a), stamp_ns(rotation.frame_b));
    if (!between) continue;
    const double angle_rad =
        rotation.q_a_b.angularDistance(Eigen::Quaterniond(between->BetweenMiddleRows()));
    sum += angle_rad * angle_rad;
    ++count;
  }
  EXPECT_GT(count, 50);
  return std::sqrt(sum / count);
}

// A motion that is followed from one focal length to the next is the one that a search there finds,
// but for pairs whose motion has two minima that are about as good.
TEST(CameraRotationsOf, FollowsWhatASearchFinds) {
  TwoViewScene scene;
  scene.q_a_b = Exp(Eigen::Vector3d(0.02, -0.03, 0.015));
  scene.p_a = Eigen::Vector3d(0.08, -0.02, 0.05);
  scene.noise_px = 0.3;
  std::vector<FramePair> pairs;
  for (unsigned seed = 0; seed < 40; ++seed) {
    pairs.push_back(scene.Make(60, seed));
    pairs.back().frame_a = static_cast<int>(seed);
  }
  std::vector<RotationTrial> trials;
  for (int k = 0; k < 8; ++k) trials.push_back({350.0 * std::pow(1.07, k), {}});
  const auto followed = CameraRotationsOf(Pictures(), pairs, trials);
  ASSERT_EQ(followed.size(), trials.size());
  int same = 0, all = 0;
  for (size_t k = 0; k < trials.size(); ++k) {
    const std::vector<CameraRotation> searched =
        CameraRotationsOf(Pictures(), pairs, {trials[k]}).front();
    ASSERT_EQ(followed[k].size(), searched.size());
    for (size_t i = 0; i < searched.size(); ++i) {
      ASSERT_EQ(followed[k][i].frame_a, searched[i].frame_a);
      const double apart_rad = followed[k][i].q_a_b.angularDistance(searched[i].q_a_b);
      same += apart_rad < 0.2 * searched[i].sigma_rad;
      ++all;
    }
  }
  EXPECT_EQ(all, 320);
  EXPECT_GE(same, 0.95 * all);
}

TEST(PairsForRotations, AreChosenBeforeTheirMatchesAreMade) {
  Recording recording;
  for (int i = 0; i < 301; ++i) {
    recording.frames.emplace_back().stamp_ns = 33'000'000LL * i;
    recording.tracks.push_back({{1, {1.0 * i, 0.0}}, {2, {0.0, 1.0 * i}}});
  }
  const std::vector<FramePair> all = PairsForRotations(recording);  // 0.1 s: three frames
  ASSERT_EQ(all.size(), 100u);
  const std::vector<FramePair> some = PairsForRotations(recording, 30);
  ASSERT_EQ(some.size(), 30u);
  for (size_t i = 0; i < some.size(); ++i) {
    const FramePair& same = all[i * 100 / 30];
    EXPECT_EQ(some[i].frame_a, same.frame_a);
    EXPECT_EQ(some[i].frame_b, same.frame_a + 3);
    ASSERT_EQ(some[i].matches.size(), 2u);
    EXPECT_EQ(some[i].matches[0].px_b.x(), some[i].frame_b);
  }
  recording.matches = all;
  recording.matches.resize(50);
  EXPECT_EQ(PairsForRotations(recording).size(), 50u);
  EXPECT_EQ(PairsForRotations(recording, 10)[3].frame_a, all[15].frame_a);
}

// Of a tracker that loses its points within 0.1 s.
TEST(PairsForRotations, AreCloserWhereTracksAreShort) {
  simulation::Scenario scenario;
  scenario.duration_s = 4.0;
  Recording recording = simulation::SimulateTracks(scenario).value().recording;
  const size_t usual = PairsForRotations(recording).size();
  for (size_t i = 0; i < recording.tracks.size(); ++i) {
    for (TrackedPoint& point : recording.tracks[i]) {
      point.track_id = 1000 * point.track_id + static_cast<int64_t>(i / 3);
    }
  }
  const std::vector<FramePair> pairs = PairsForRotations(recording);
  EXPECT_GT(pairs.size(), usual);
  std::vector<size_t> counts;
  for (const FramePair& pair : pairs) {
    EXPECT_EQ(pair.frame_b, pair.frame_a + 1);
    counts.push_back(pair.matches.size());
  }
  EXPECT_GE(MedianInPlace(&counts), 30u);
}

TEST(CameraRotationsOf, LeavesOutPairsThatHaveNone) {
  TwoViewScene scene;
  scene.p_a = Eigen::Vector3d(0.08, -0.02, 0.05);
  const std::vector<FramePair> pairs = {scene.Make(100, 1), scene.Make(5, 2), scene.Make(100, 3)};
  const auto found = CameraRotationsOf(Pictures(), pairs, {{450.0, {}}, {480.0, {}}});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].size(), 2u);
  EXPECT_EQ(found[1].size(), 2u);
  EXPECT_TRUE(CameraRotationsOf(Pictures(), pairs, {}).empty());
}

// Rates that change while the rows are read look like parallax. The gyro undoes it, also where its
// delay, orientation and readout time are off by what a start's are.
TEST(CameraRotationsOf, AGyroUndoesTheRollingShutter) {
  simulation::Scenario scenario;
  scenario.duration_s = 8.0;
  scenario.camera.readout_s = 0.024;
  scenario.tracks.noise_px = 0.1;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const std::vector<FramePair> pairs = PairsForRotations(s.recording);
  const Calibration& truth = s.truth;
  RoughAlignment rough;
  rough.q_gyro_cam = truth.q_gyro_cam * Exp(Eigen::Vector3d(0.01, -0.01, 0.01));
  rough.bias_gyro_rad_s = truth.bias_gyro_rad_s;
  rough.readout_s = 0.020;
  rough.delay_middle_row_s = truth.delay_s + 0.5 * truth.readout_s + 0.003;
  const double focal_px = truth.lens[kFocal];
  const auto rms_of = [&](const std::vector<CameraRotation>& rotations) {
    EXPECT_GE(rotations.size(), pairs.size() - 5);
    return RmsError(rotations, s);
  };
  const double without = rms_of(CameraRotationsOf(s.recording, pairs, {{focal_px, {}}}).front());
  const double with = rms_of(CameraRotationsOf(s.recording, pairs, {{focal_px, rough}}).front());
  EXPECT_GT(without, 0.004);
  EXPECT_LT(with, 0.3 * without);
}

// A lens that holds the picture still takes turns out of it; where it was logged, they come back.
TEST(CameraRotationsOf, PutsALoggedLensBack) {
  simulation::Scenario scenario;
  scenario.duration_s = 6.0;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.effects.optical_stabilisation.gain = 0.9;
  scenario.effects.optical_stabilisation.log_hz = 250.0;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const std::vector<FramePair> pairs = PairsForRotations(s.recording);
  const auto rms_of = [&](const Recording& recording) {
    const RoughAlignment rough{s.truth.q_gyro_cam, s.truth.bias_gyro_rad_s,
                               s.truth.delay_s + 0.5 * s.truth.readout_s, 0.0, s.truth.readout_s};
    const std::vector<CameraRotation> rotations =
        CameraRotationsOf(recording, pairs, {{s.truth.lens[kFocal], rough}}).front();
    return RmsError(rotations, s);
  };
  Recording without = s.recording;
  without.lens_shift.clear();
  EXPECT_LT(rms_of(s.recording), 0.2 * rms_of(without));
}

// On a circle through a room the camera steps sideways all the time, past points at similar
// distances. Taken for rotations, as they were in some of the pairs (5 mrad in the mean of all),
// these steps add up to a turn that the gyro does not feel, and the start makes a bias of it.
TEST(CameraRotationsOf, StepsThroughARoomAreNoTurn) {
  simulation::Scenario scenario;
  scenario.seed = 14;
  scenario.duration_s = 10.0;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kHandheld);
  scenario.motion.speed_m_s = 0.8;
  scenario.motion.path_radius_m = 1.5;
  scenario.motion.heading_deg = 60.0;
  scenario.scene.kind = simulation::SceneKind::kRoom;
  scenario.tracks.noise_px = 0.5;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const Recording& recording = s.recording;
  const RoughAlignment rough{s.truth.q_gyro_cam, s.truth.bias_gyro_rad_s,
                             s.truth.delay_s + 0.5 * s.truth.readout_s, 0.0, s.truth.readout_s};
  const std::vector<CameraRotation> rotations =
      CameraRotationsOf(recording, PairsForRotations(recording), {{s.truth.lens[kFocal], rough}})
          .front();
  ASSERT_GE(rotations.size(), 90u);
  Eigen::Vector3d mean_rad = Eigen::Vector3d::Zero();
  for (const CameraRotation& rotation : rotations) {
    const auto stamp_ns = [&](int frame) {
      return recording.frames[static_cast<size_t>(frame)].stamp_ns;
    };
    const auto gyro = GyroRotation::Between(recording.gyro, s.truth, stamp_ns(rotation.frame_a),
                                            stamp_ns(rotation.frame_b));
    ASSERT_TRUE(gyro.has_value());
    const Eigen::Quaterniond truth(gyro->BetweenMiddleRows());
    mean_rad += Log(Eigen::Quaterniond(truth.conjugate() * rotation.q_a_b)) /
                static_cast<double>(rotations.size());
  }
  EXPECT_LT(mean_rad.norm(), 2e-3) << mean_rad.transpose();
}

}  // namespace
}  // namespace camgyro
