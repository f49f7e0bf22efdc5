// Lenses of simulated and measured recordings, by their matches alone.
#include "frontend/lens_from_matches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>

#include "frontend/readers/read_recording.h"
#include "simulation/simulate.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

using simulation::MotionKind;

// A corner is 400 px off, at a focal length of 500 px.
simulation::Scenario Through(double k1, double k2, MotionKind motion) {
  simulation::Scenario scenario;
  scenario.seed = 3;
  scenario.duration_s = 6.0;
  scenario.camera.focal_px = 500.0;
  scenario.motion = simulation::MotionPreset(motion);
  scenario.tracks.noise_px = 0.3;
  scenario.tracks.outlier_fraction = 0.05;
  scenario.effects.radial_distortion.k1 = k1;
  scenario.effects.radial_distortion.k2 = k2;
  return scenario;
}

Recording TracksOf(const simulation::Scenario& scenario) {
  return simulation::SimulateTracks(scenario)->recording;
}

double TakenFrom(Recording recording) {
  TakeLensFromMatches(&recording);
  return recording.camera.division_lambda;
}

// A rolling shutter, steps and runs, and no steps at all: none looks like a lens.
TEST(FindLensFromMatches, SeesNoneWhereThereIsNone) {
  for (const MotionKind motion : {MotionKind::kWalking, MotionKind::kRunning, MotionKind::kSlow,
                                  MotionKind::kPanning, MotionKind::kRotation}) {
    const Recording recording = TracksOf(Through(0.0, 0.0, motion));
    const auto lens = FindLensFromMatches(recording);
    ASSERT_TRUE(lens);
    EXPECT_LT(std::abs(lens->lambda), 4.0 * lens->sigma);
    EXPECT_LT(std::abs(lens->lambda), 0.03);
    EXPECT_EQ(TakenFrom(recording), 0.0);
  }
}

// What these lenses do to a corner, whose pixel is at r = 0.80. A division lens is not quite one of
// theirs, and the nearest one moves it by up to a quarter more.
TEST(FindLensFromMatches, SeesHowFarTheCornersAreMoved) {
  for (const MotionKind motion : {MotionKind::kRunning, MotionKind::kPanning}) {
    for (const auto& [k1, k2, lambda] :
         {std::tuple(-0.28, 0.07, -0.21), {-0.14, 0.03, -0.10}, {0.15, 0.0, 0.085}}) {
      const Recording recording = TracksOf(Through(k1, k2, motion));
      const auto lens = FindLensFromMatches(recording);
      ASSERT_TRUE(lens);
      EXPECT_NEAR(lens->lambda, lambda, 0.25 * std::abs(lambda) + 0.02) << k1;
      EXPECT_LT(lens->sigma, 0.02) << k1;
      EXPECT_EQ(TakenFrom(recording), lens->lambda);
    }
  }
}

// Where things are near and far, through few noisy tracks, and all over the range of lenses: with
// the matches that fit the lines of no lens best, it found none in half of such rooms.
TEST(FindLensFromMatches, SeesItInARoom) {
  for (const uint64_t seed : {1, 2, 5, 7}) {
    simulation::Scenario scenario = Through(-0.28, 0.07, MotionKind::kHandheld);
    scenario.seed = seed;
    scenario.scene.kind = simulation::SceneKind::kRoom;
    scenario.motion.speed_m_s = 0.8;
    scenario.motion.path_radius_m = 1.5;
    scenario.motion.heading_deg = 60.0;
    scenario.tracks.count = 50;
    scenario.tracks.noise_px = 0.7;
    EXPECT_NEAR(TakenFrom(TracksOf(scenario)), -0.21, 0.07) << seed;
  }
}

TEST(FindLensFromMatches, SaysNothingOfAFewTracks) {
  simulation::Scenario scenario = Through(-0.28, 0.07, MotionKind::kWalking);
  scenario.tracks.count = 15;
  EXPECT_FALSE(FindLensFromMatches(TracksOf(scenario)));
  EXPECT_EQ(TakenFrom(TracksOf(scenario)), 0.0);
  EXPECT_FALSE(FindLensFromMatches(Recording{}));
}

// Points that are anywhere in every frame lie on no lines, through whatever lens.
TEST(FindLensFromMatches, TakesNothingFromNonsense) {
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    Recording recording = TracksOf(Through(0.0, 0.0, MotionKind::kWalking));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(0.0, 640.0), v(0.0, 480.0);
    for (auto& points : recording.tracks) {
      for (TrackedPoint& point : points) point.px << u(random), v(random);
    }
    EXPECT_EQ(TakenFrom(recording), 0.0) << seed;
  }
}

// What is declared is believed, where it is that of the camera.
TEST(FindLensFromMatches, SeesThroughADeclaredLens) {
  Recording recording = TracksOf(Through(-0.28, 0.07, MotionKind::kWalking));
  recording.camera.focal_px = 500.0;
  recording.camera.distortion_model = DistortionModel::kRadTan;
  recording.camera.distortion = {-0.28, 0.07, 0.0, 0.0};
  const auto lens = FindLensFromMatches(recording);
  ASSERT_TRUE(lens);
  EXPECT_LT(std::abs(lens->lambda), 0.02);
  TakeLensFromMatches(&recording);
  EXPECT_TRUE(recording.faults.empty());
  EXPECT_EQ(recording.camera.distortion.size(), 4U);
  EXPECT_EQ(recording.camera.division_lambda, 0.0);
}

TEST(FindLensFromMatches, LeavesOutTheLensOfAnotherCamera) {
  for (const double k1 : {0.0, -0.28}) {
    Recording recording = TracksOf(Through(k1, 0.0, MotionKind::kWalking));
    recording.camera.focal_px = 500.0;
    recording.camera.distortion_model = DistortionModel::kRadTan;
    recording.camera.distortion = {-0.14, 0.0, 0.0, 0.0};
    Recording without_focal = recording;
    TakeLensFromMatches(&recording);
    ASSERT_EQ(recording.faults.size(), 1U) << k1;
    EXPECT_EQ(recording.faults.front().name, "declared_distortion");
    EXPECT_EQ(recording.camera.distortion_model, DistortionModel::kNone);
    EXPECT_TRUE(recording.camera.distortion.empty());
    EXPECT_EQ(recording.camera.division_lambda < -0.1, k1 < 0.0);
    // Nobody knows what coefficients mean whose focal length is not declared.
    without_focal.camera.focal_px.reset();
    TakeLensFromMatches(&without_focal);
    EXPECT_TRUE(without_focal.faults.empty());
  }
}

// EuRoC's lens, k1 -0.283 and k2 0.074 at f 458, moves a corner by 27 %.
TEST(FindLensFromMatches, Measured) {
  for (const char* name : {"ov_corridor_rs", "ov_corridor_rs_klt", "ov_handheld_gs"}) {
    const auto folder = MeasuredData(name);
    if (!folder) GTEST_SKIP() << name << " is not there (CAMGYRO_DATA)";
    const Result<Recording> recording = ReadRecording(*folder);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_NEAR(TakenFrom(*recording), -0.32, 0.03) << name;
  }
}

}  // namespace
}  // namespace camgyro
