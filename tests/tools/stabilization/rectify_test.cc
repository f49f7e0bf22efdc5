#include "tools/stabilization/rectify.h"

#include <gmock/gmock.h>

#include <cmath>
#include <memory>

#include "core/effects/catalogue.h"
#include "core/time.h"
#include "simulation/simulate.h"
#include "tools/stabilization/registration.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

// Turning only, without noise: what is left after rectification is what it does wrong. The lens
// bends by 8 px in the corners, rows are exposed over 25 ms.
simulation::Simulated Turning() {
  const auto scenario = simulation::ParseScenario(R"(
duration_s: 3
seed: 4
motion: {kind: rotation, speed_m_s: 0, sway_rms_m_s: 0}
camera: {readout_s: 0.025, delay_s: -0.011}
tracks: {noise_px: 0}
gyro: {noise_density_rad_s_rtHz: 0, bias_walk_rad_s2_rtHz: 0}
effects: {radial_distortion: {k1: -0.1, k2: 0.02}}
)");
  EXPECT_TRUE(scenario) << scenario.error().message;
  return *simulation::SimulateTracks(*scenario);
}

double Turned(const Rectified& rectified) {
  return RegisterRectified(rectified.recording, rectified.calibration,
                           PairsFromTracks(rectified.recording.tracks, 1))
      ->turned_px;
}

TEST(Rectify, FramesAreAsOfAGlobalShutterOnTheGyrosClock) {
  const simulation::Simulated s = Turning();
  for (const bool undistort : {false, true}) {
    RectifyOptions options;
    options.undistort = options.remove_bias = undistort;
    Recording recorded = s.recording;
    const auto rectified = Rectify(s.truth, options, &recorded);
    ASSERT_TRUE(rectified) << rectified.error().message;
    EXPECT_EQ(rectified->calibration.readout_s, 0.0);
    EXPECT_EQ(rectified->calibration.delay_s, 0.0);
    EXPECT_EQ(rectified->calibration.distortion_model,
              undistort ? DistortionModel::kNone : DistortionModel::kRadTan);
    // Neighbouring frames differ by the gyro's turn between their stamps, and by nothing else.
    EXPECT_LT(Turned(*rectified), 0.02);
    EXPECT_GT(rectified->shift_px, undistort ? 3.0 : 2.0);
    const Recording& out = rectified->recording;
    ASSERT_EQ(out.frames.size(), s.recording.frames.size());
    EXPECT_NEAR(SecondsSince(s.recording.frames[5].stamp_ns, out.frames[5].stamp_ns),
                s.truth.delay_s + 0.5 * s.truth.readout_s, 2e-9);
    EXPECT_LT((s.recording.gyro[9].omega_gyro_rad_s - out.gyro[9].omega_gyro_rad_s -
               (undistort ? s.truth.bias_gyro_rad_s : Eigen::Vector3d(0.0, 0.0, 0.0)))
                  .norm(),
              1e-15);
  }
  // Taken for granted, the readout leaves more than it should.
  Calibration without = s.truth;
  without.readout_s = 0.0;
  Recording recorded = s.recording;
  EXPECT_GT(Turned(*Rectify(without, {}, &recorded)), 0.5);
}

// A stabilised lens makes up for nine tenths of the turns: after rectification it has not moved.
TEST(Rectify, TakesOutWhatALensDidWhileItWasRead) {
  simulation::Scenario scenario;
  scenario.duration_s = 3.0;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRotation);
  scenario.motion.speed_m_s = scenario.motion.sway_rms_m_s = 0.0;
  scenario.tracks.noise_px = 0.0;
  scenario.gyro.noise_density_rad_s_rtHz = scenario.gyro.bias_walk_rad_s2_rtHz = 0.0;
  scenario.effects.optical_stabilisation = {0.9, 0.5};
  scenario.effects.optical_stabilisation.log_hz = 500.0;
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  EffectSetup setup;
  setup.size_px << s.truth.width_px, s.truth.height_px;
  setup.readout_s = s.truth.readout_s;
  setup.lens_shift =
      std::make_shared<LensShift>(s.recording.lens_shift, s.recording.gyro.front().stamp_ns);
  Calibration with = s.truth;
  with.effects =
      std::make_shared<const EffectSet>(MakeEffects("optical_stabilisation:logged", setup).value());
  with.effect_values = Eigen::VectorXd::Unit(4, 0);
  Recording recorded = s.recording;
  const auto rectified = Rectify(with, {}, &recorded);
  ASSERT_TRUE(rectified) << rectified.error().message;
  EXPECT_LT(Turned(*rectified), 0.02);
  EXPECT_EQ(rectified->calibration.effects, nullptr);
  recorded = s.recording;
  EXPECT_GT(Turned(*Rectify(s.truth, {}, &recorded)), 1.0);
}

TEST(Rectify, DropsWhatLeavesThePictureOrTheGyrosTime) {
  simulation::Simulated s = Turning();
  const size_t frames = s.recording.frames.size();
  size_t points = 0, kept = 0;
  for (const auto& frame : s.recording.tracks) points += frame.size();
  s.recording.gyro.erase(s.recording.gyro.begin(), s.recording.gyro.begin() + 140);
  const auto rectified = Rectify(s.truth, {}, &s.recording);
  ASSERT_TRUE(rectified) << rectified.error().message;
  EXPECT_GT(rectified->first_frame, 3);
  EXPECT_EQ(rectified->frames_dropped, rectified->first_frame);
  EXPECT_EQ(rectified->recording.tracks.size(), rectified->recording.frames.size());
  EXPECT_TRUE(s.recording.tracks.empty());  // they were taken, not copied
  EXPECT_EQ(rectified->recording.frames.size() + static_cast<size_t>(rectified->frames_dropped),
            frames);
  for (const auto& frame : rectified->recording.tracks) {
    kept += frame.size();
    for (const TrackedPoint& point : frame) {
      EXPECT_TRUE(point.px.x() >= -0.5 && point.px.x() <= s.truth.width_px - 0.5) << point.px;
      EXPECT_TRUE(point.px.y() >= -0.5 && point.px.y() <= s.truth.height_px - 0.5) << point.px;
    }
  }
  EXPECT_LT(kept, points);
  EXPECT_GT(kept, points * 8 / 10 * rectified->recording.frames.size() / frames);
}

TEST(Rectify, RefusesWhatItCannotTurn) {
  simulation::Simulated s = Turning();
  Calibration other = s.truth;
  other.delay_s = 1e4;
  EXPECT_THAT(Rectify(other, {}, &s.recording).error().message, HasSubstr("gyro's time"));
  other = s.truth;
  other.width_px = 100;
  EXPECT_THAT(Rectify(other, {}, &s.recording).error().message, HasSubstr("expected 100 x"));
  s.recording.tracks.clear();
  EXPECT_THAT(Rectify(s.truth, {}, &s.recording).error().message,
              HasSubstr("neither pictures nor tracks"));
}

}  // namespace
}  // namespace camgyro
