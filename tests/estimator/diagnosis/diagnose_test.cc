// The whole diagnosis: what it hands on of the fits that it makes.
#include "estimator/diagnosis/diagnose.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "simulation/simulate.h"

namespace camgyro {
namespace {

// Where nothing is added, its result is what calibrate has, times of frames between the pairs
// included.
TEST(Diagnose, WithoutAnEffectFramesInBetweenHaveTimesAsWell) {
  simulation::Scenario scenario;
  scenario.duration_s = 12.0;
  scenario.tracks.reanchored = true;
  scenario.effects.frame_stamp_jitter.spread_s = 2e-3;
  const auto simulated = simulation::SimulateTracks(scenario, 5);
  ASSERT_TRUE(simulated);
  DiagnoseOptions options;
  options.calibrate.given_start.emplace();
  options.calibrate.given_start->delay_middle_row_s = simulated->truth.delay_s + 0.012;
  options.calibrate.given_start->q_gyro_cam = simulated->truth.q_gyro_cam;
  options.calibrate.online = false;
  options.calibrate.effects = "frame_stamp_jitter";
  Recording recording = simulated->recording;
  recording.camera.focal_px = 1.02 * simulated->truth.lens[kFocal];

  const auto calibrated = CalibrateRecording(recording, nullptr, options.calibrate);
  ASSERT_TRUE(calibrated) << calibrated.error().message;
  const Diagnosis diagnosis = Diagnose(nullptr, options, &recording);
  ASSERT_TRUE(diagnosis.before);
  ASSERT_FALSE(diagnosis.after);
  const auto& times = diagnosis.result().frame_times;
  EXPECT_GT(times.size(), recording.frames.size() - 4);
  ASSERT_EQ(times.size(), calibrated->frame_times.size());
  for (size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ(times[i].frame, calibrated->frame_times[i].frame);
    EXPECT_NEAR(times[i].offset_s, calibrated->frame_times[i].offset_s, 1e-6);
  }
}

// An effect is significant by chance (focal_drift, p = 0.0006 of 25 candidates), in a recording
// like number 234 of tools/diagnose_simulated.py --clean 1-600, and beside another one that is
// there.
TEST(Diagnose, WithdrawsWhatAllFramesDoNotBearOut) {
  for (const double skew_ppm : {0.0, 400.0}) {
    SCOPED_TRACE(skew_ppm);
    simulation::Scenario scenario;
    scenario.seed = 1234;
    scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
    scenario.duration_s = 14.0;
    scenario.tracks.noise_px = 0.2;
    scenario.tracks.outlier_fraction = 0.05;
    scenario.camera.exposure_swing = 0.5;
    scenario.effects.clock_skew.ppm = skew_ppm;
    const auto simulated = simulation::SimulateTracks(scenario);
    ASSERT_TRUE(simulated);
    DiagnoseOptions options;
    options.significance = 0.02;
    options.calibrate.given_start.emplace();
    options.calibrate.given_start->delay_middle_row_s = simulated->truth.delay_s + 0.01;
    options.calibrate.given_start->q_gyro_cam = simulated->truth.q_gyro_cam;
    Recording recording = simulated->recording;
    recording.camera.focal_px = 1.02 * simulated->truth.lens[kFocal];

    const Diagnosis diagnosis = Diagnose(nullptr, options, &recording);
    ASSERT_TRUE(diagnosis.before);
    const size_t right = skew_ppm > 0.0 ? 1 : 0;
    ASSERT_GT(diagnosis.rounds.size(), right);
    EXPECT_EQ(diagnosis.rounds[right].added, "focal_drift");
    EXPECT_NE(diagnosis.rounds[right].withdrawn, "");
    EXPECT_TRUE(diagnosis.result().doubts.empty()) << diagnosis.result().doubts[0];
    if (right == 0) {
      EXPECT_TRUE(diagnosis.effects.empty());
      EXPECT_FALSE(diagnosis.after);
      EXPECT_EQ(diagnosis.result().calibration.effects, nullptr);
    } else {
      EXPECT_EQ(diagnosis.effects, std::vector<std::string>{"clock_skew"});
      ASSERT_TRUE(diagnosis.after);
      ASSERT_EQ(diagnosis.after->calibration.effect_values.size(), 1);
      EXPECT_NEAR(diagnosis.after->calibration.effect_values[0], skew_ppm, 25.0);
    }
  }
}

}  // namespace
}  // namespace camgyro
