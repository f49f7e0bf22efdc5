#include "pipeline/track_noise.h"

#include <gtest/gtest.h>

#include "frontend/readers/read_recording.h"
#include "simulation/simulate.h"
#include "tests/estimator/simulated_input.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

using simulation::MotionKind;

constexpr int kGap = 5;

simulation::Scenario Moving(MotionKind kind, double noise_px, bool reanchored) {
  simulation::Scenario scenario;
  scenario.seed = 4;
  scenario.duration_s = 8.0;
  scenario.motion = simulation::MotionPreset(kind);
  scenario.tracks.noise_px = noise_px;
  scenario.tracks.reanchored = reanchored;
  return scenario;
}

// As a file has them, which does not say how they were made.
Recording TracksOf(const simulation::Scenario& scenario) {
  Recording recording = simulation::SimulateTracks(scenario)->recording;
  recording.match_noise = MatchNoise::kBothImages;
  return recording;
}

// Whatever the motion, with parallax and without, and through a lens that nothing declares.
TEST(GrowthOfTrackNoise, IsOneOfErrorsOfTheirOwnAndTheGapOfOnesThatAddUp) {
  for (const MotionKind kind :
       {MotionKind::kWalking, MotionKind::kRunning, MotionKind::kSlow, MotionKind::kRotation}) {
    simulation::Scenario own = Moving(kind, 0.5, false), sum = Moving(kind, 0.1, true);
    sum.effects.radial_distortion.k1 = own.effects.radial_distortion.k1 = -0.1;
    EXPECT_NEAR(GrowthOfTrackNoise(TracksOf(own), kGap), 1.0, 0.25);
    EXPECT_NEAR(GrowthOfTrackNoise(TracksOf(sum), kGap), kGap, 0.3 * kGap);
  }
  EXPECT_FALSE(TrackNoiseAddsUp(TracksOf(Moving(MotionKind::kRunning, 0.5, false))));
  EXPECT_TRUE(TrackNoiseAddsUp(TracksOf(Moving(MotionKind::kRunning, 0.1, true))));
}

TEST(GrowthOfTrackNoise, IsNotFooledByWrongMatches) {
  simulation::Scenario scenario = Moving(MotionKind::kWalking, 0.5, false);
  scenario.tracks.outlier_fraction = 0.05;
  scenario.scene.moving_fraction = 0.1;
  EXPECT_FALSE(TrackNoiseAddsUp(TracksOf(scenario)));
}

// Near and far things through a strong lens, which has to be known (pipeline/run.h): this recording
// was told that its tracks' errors add up, and its focal length was 6 % off.
TEST(GrowthOfTrackNoise, IsNotFooledByALens) {
  simulation::Scenario scenario = RoomThroughALens();
  scenario.seed = 4;
  Recording recording = TracksOf(scenario);
  EXPECT_TRUE(TrackNoiseAddsUp(recording));
  recording.camera.division_lambda = -0.3;
  EXPECT_FALSE(TrackNoiseAddsUp(recording));
  recording.camera.division_lambda = 0.0;
  recording.camera.distortion_model = DistortionModel::kRadTan;
  recording.camera.distortion = {-0.28, 0.07, 0.0, 0.0};
  recording.camera.focal_px = 458.0;
  EXPECT_FALSE(TrackNoiseAddsUp(recording));
}

TEST(GrowthOfTrackNoise, SaysNothingOfAFewTracks) {
  simulation::Scenario scenario = Moving(MotionKind::kWalking, 0.1, true);
  scenario.tracks.count = 10;
  const Recording few = TracksOf(scenario);
  EXPECT_EQ(GrowthOfTrackNoise(few, kGap), 0.0);
  EXPECT_FALSE(TrackNoiseAddsUp(few));
  EXPECT_FALSE(TrackNoiseAddsUp(Recording{}));
}

// Tracks of another simulator, whose observations have errors of their own, long and short ones.
TEST(GrowthOfTrackNoise, Measured) {
  for (const char* name : {"ov_corridor_rs", "ov_corridor_rs_klt", "ov_handheld_gs"}) {
    const auto folder = MeasuredData(name);
    if (!folder) GTEST_SKIP() << name << " is not there (CAMGYRO_DATA)";
    const Result<Recording> recording = ReadRecording(*folder);
    ASSERT_TRUE(recording) << recording.error().message;
    const double growth = GrowthOfTrackNoise(*recording, kGap);
    EXPECT_GT(growth, 0.8) << name;
    EXPECT_LT(growth, 1.6) << name;
  }
}

}  // namespace
}  // namespace camgyro
