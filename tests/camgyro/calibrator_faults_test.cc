// Streams with faults, through the streaming library: what is late, missing or wrong.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "camgyro/calibrator.h"
#include "core/time.h"
#include "simulation/simulate.h"
#include "tests/camgyro/feed_calibrator.h"

namespace camgyro::api {
namespace {

using simulation::Scenario;
using simulation::Simulated;

TEST(CalibratorFaults, GyroThatComesAfterTheFramesIsUsed) {
  const Scenario scenario = LivelyScenario(7.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const Recording& r = s.recording;
  const auto calibrator = Make(OptionsFor(scenario));
  for (size_t i = 0; i < r.frames.size(); ++i) Add(calibrator.get(), r, i);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  EXPECT_THAT(calibrator->snapshot()->message, testing::HasSubstr("hardly any gyro samples"));
  for (const GyroSample& sample : r.gyro) Add(calibrator.get(), sample);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_LT(Sigmas(snapshot->calibration.delay_s, s.truth.delay_s, snapshot->parameters[kDelay]),
            5.0);
}

TEST(CalibratorFaults, GyroThatNeverComesIsNamed) {
  const Scenario scenario = LivelyScenario(6.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  for (size_t i = 0; i < s.recording.frames.size(); ++i) {
    ASSERT_EQ(Add(calibrator.get(), s.recording, i), AddResult::kAccepted);
  }
  ASSERT_TRUE(calibrator->WaitUntilIdle(60.0));
  EXPECT_THAT(calibrator->snapshot()->message, testing::HasSubstr("gyro"));
}

TEST(CalibratorFaults, TooFewFramesSayHowManyMore) {
  const Simulated s = simulation::SimulateTracks(LivelyScenario(4.0)).value();
  const auto calibrator = Make(OptionsFor(LivelyScenario(4.0)));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(60.0));
  EXPECT_THAT(calibrator->snapshot()->message, testing::HasSubstr(" of 5.0 s"));
}

TEST(CalibratorFaults, LateFramesAreNamed) {
  const Scenario scenario = LivelyScenario(6.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  ASSERT_TRUE(calibrator->snapshot()->has_estimate) << calibrator->snapshot()->message;
  // The gyro runs on for a quarter of a minute, then the camera's next frame arrives.
  GyroSample later = s.recording.gyro.back();
  later.stamp_ns += 15'000'000'000;
  ASSERT_EQ(Add(calibrator.get(), later), AddResult::kAccepted);
  const TrackPoint point = {1, 10.0, 10.0};
  EXPECT_EQ(calibrator->AddTracks(s.recording.frames.back().stamp_ns + 33'000'000, &point, 1),
            AddResult::kTooLate);
}

// One observation in seven is off by 20 px, two matches in seven are wrong: most of the former
// leave their track, and the noise is that of the others.
TEST(CalibratorFaults, LeavesOutPointsThatJumpOffTheirTrack) {
  Scenario scenario = LivelyScenario(9.0);
  scenario.tracks.outlier_fraction = 0.15;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_EQ(snapshot->frames, s.recording.frames.size());
  EXPECT_NEAR(snapshot->wrong_ratio, 0.15, 0.03);
  EXPECT_NEAR(snapshot->noise_px, 0.3, 0.05);
  const Calibration& c = snapshot->calibration;
  EXPECT_LT(Sigmas(c.focal_px, s.truth.lens[camgyro::kFocal], snapshot->parameters[kFocal]), 3.5);
  EXPECT_LT(Sigmas(c.readout_s, s.truth.readout_s, snapshot->parameters[kReadout]), 3.5);
  EXPECT_LT(Sigmas(c.delay_s, s.truth.delay_s, snapshot->parameters[kDelay]), 3.5);
}

TEST(CalibratorFaults, SurvivesStreamsThatStopAndClocksThatJump) {
  const Scenario scenario = LivelyScenario(7.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const Recording& r = s.recording;
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), r);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  ASSERT_TRUE(calibrator->snapshot()->has_estimate);
  // The gyro falls silent; the camera goes on for 12 s.
  int64_t stamp_ns = r.frames.back().stamp_ns;
  const std::vector<TrackPoint> points = Points(r.tracks.back());
  for (int i = 0; i < 360; ++i) {
    stamp_ns += 33'000'000;
    ASSERT_EQ(calibrator->AddTracks(stamp_ns, points.data(), points.size()), AddResult::kAccepted);
  }
  ASSERT_TRUE(calibrator->WaitUntilIdle(60.0));
  EXPECT_EQ(calibrator->snapshot()->stage, Stage::kCollecting);
  EXPECT_FALSE(calibrator->snapshot()->has_estimate);
  EXPECT_FALSE(calibrator->snapshot()->ready);
  // Both clocks jump by an hour, and all begins anew: an estimate comes again.
  const int64_t jump_ns = 3'600'000'000'000;
  Recording again = r;
  for (auto& frame : again.frames) frame.stamp_ns += jump_ns;
  for (auto& sample : again.gyro) sample.stamp_ns += jump_ns;
  for (auto& sample : again.accel) sample.stamp_ns += jump_ns;
  Feed(calibrator.get(), again);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_LT(Sigmas(snapshot->calibration.delay_s, s.truth.delay_s, snapshot->parameters[kDelay]),
            5.0);
}

// Its window would have to know where the lens is at every sample to come: it says so, and has no
// estimate.
TEST(CalibratorFaults, SaysThatTheLensIsStabilised) {
  simulation::Scenario scenario = LivelyScenario(9.0);
  scenario.effects.optical_stabilisation = {0.9, 0.5, 0.025};
  const simulation::Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  EXPECT_FALSE(calibrator->snapshot()->has_estimate);
  EXPECT_THAT(calibrator->snapshot()->message, testing::HasSubstr("switch its stabilisation off"));
}

}  // namespace
}  // namespace camgyro::api
