// The streaming library as a program of others uses it: public headers only (the simulator makes
// the data).
#include "camgyro/calibrator.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "camgyro/version.h"
#include "core/time.h"
#include "simulation/render.h"
#include "simulation/simulate.h"
#include "tests/camgyro/feed_calibrator.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro::api {
namespace {

using simulation::Scenario;
using simulation::Simulated;

TEST(Calibrator, FindsTheTruthAndSaysWhenItIsReady) {
  const Scenario scenario = LivelyScenario(9.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  EXPECT_EQ(calibrator->snapshot()->stage, Stage::kCollecting);
  EXPECT_FALSE(calibrator->snapshot()->has_estimate);
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));

  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_EQ(snapshot->stage, Stage::kEstimating);
  EXPECT_EQ(snapshot->frames, s.recording.frames.size());
  EXPECT_GE(snapshot->pairs_used, s.recording.frames.size() / 10);  // pairs lie side by side
  EXPECT_EQ(snapshot->pairs_skipped, 0u);
  EXPECT_NEAR(snapshot->noise_px, 0.3, 0.05);
  EXPECT_LT(snapshot->wrong_ratio, 5e-3);
  EXPECT_EQ(snapshot->lens, "");
  const Calibration& c = snapshot->calibration;
  const auto& p = snapshot->parameters;
  EXPECT_LT(Sigmas(c.focal_px, s.truth.lens[camgyro::kFocal], p[kFocal]), 4.0);
  EXPECT_LT(Sigmas(c.readout_s, s.truth.readout_s, p[kReadout]), 4.0);
  EXPECT_LT(Sigmas(c.delay_s, s.truth.delay_s, p[kDelay]), 4.0);
  const Eigen::Quaterniond q(c.q_gyro_cam_wxyz[0], c.q_gyro_cam_wxyz[1], c.q_gyro_cam_wxyz[2],
                             c.q_gyro_cam_wxyz[3]);
  EXPECT_LT(q.angularDistance(s.truth.q_gyro_cam), 0.01);
  for (int i = 0; i < kParameters; ++i) {
    EXPECT_DOUBLE_EQ(p[static_cast<size_t>(i)].sigma,
                     std::sqrt(c.covariance[static_cast<size_t>(i * kParameters + i)]));
  }
  // The total is known, and larger: some of what a phone may have lies in the data's blind spot.
  EXPECT_TRUE(snapshot->doubt.empty()) << snapshot->doubt;
  for (int i = 0; i < kParameters; ++i) {
    const ParameterState& state = p[static_cast<size_t>(i)];
    EXPECT_GT(state.sigma_total, state.sigma) << ParameterName(i);
    EXPECT_LT(state.sigma_total, state.wanted_sigma) << ParameterName(i);
    EXPECT_DOUBLE_EQ(state.sigma_total,
                     std::sqrt(c.total_covariance[static_cast<size_t>(i * kParameters + i)]));
  }
  EXPECT_EQ(p[kDelay].readiness, Readiness::kReady) << ToString(p[kDelay].readiness);
  EXPECT_EQ(p[kFocal].readiness, Readiness::kReady) << ToString(p[kFocal].readiness);
  EXPECT_TRUE(snapshot->ready);

  // And a VIO can start from it.
  VinsSettings settings;
  settings.accel_noise_m_s2_rtHz = scenario.gyro.accel_noise_density_m_s2_rtHz;
  const VinsStart start = calibrator->InitialiseVins(settings);
  ASSERT_EQ(start.verdict, VinsVerdict::kReady) << start.explanation;
  const VinsState& last = start.states.back();
  const simulation::CameraState truth =
      s.camera->trajectory().At(1e-9 * static_cast<double>(last.time_ns - scenario.start_ns));
  // Velocities in different worlds: their lengths agree, but for the lever arm (0.06 m x 1 rad/s).
  const double speed =
      Eigen::Vector3d(last.v_world_m_s[0], last.v_world_m_s[1], last.v_world_m_s[2]).norm();
  EXPECT_NEAR(speed, truth.v_world_m_s.norm(), 0.12);
  EXPECT_EQ(start.covariance.size(), start.covariance_size * start.covariance_size);
  EXPECT_EQ(start.covariance_size, 9 * start.states.size() + 9 + kParameters);
}

// Stamps of a phone's logger: late by 2 ms in the mean. The clock is where the median stamp is on
// time, so that the delay holds the median of an exponential latency, ln 2 times its mean.
TEST(Calibrator, LaysArrivalTimesOnTheirClock) {
  const Scenario scenario = LivelyScenario(9.0);
  Simulated s = simulation::SimulateTracks(scenario).value();
  std::mt19937 random(2);
  std::exponential_distribution<double> latency_s(1.0 / 2e-3);
  int64_t last_ns = 0;
  for (GyroSample& sample : s.recording.gyro) {
    last_ns = std::max(last_ns + 1000, StampAt(sample.stamp_ns, latency_s(random)));
    sample.stamp_ns = last_ns;
  }
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  EXPECT_THAT(snapshot->gyro_stamps, testing::HasSubstr("arrival times"));
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_NEAR(snapshot->calibration.delay_s, s.truth.delay_s + std::log(2.0) * 2e-3, 0.4e-3);
}

// The stamps of a phone's frames: late by 2 ms in the mean, some by 10. The delay is that of the
// mean stamp, and the latest frame's own time is known. Stamps that are taken as they are put
// parameters off by many of their sigmas.
TEST(Calibrator, FramesThatCameLateHaveTimesOfTheirOwn) {
  Scenario scenario = LivelyScenario(14.0);
  scenario.effects.frame_stamp_jitter.latency_s = 2e-3;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const Recording& r = s.recording;
  const auto calibrator = Make(OptionsFor(scenario));
  size_t gyro = 0;
  int estimates = 0;
  double sum_sq_s = 0.0, sum_sq_sigmas = 0.0;
  std::map<int64_t, double> delays_s;
  for (size_t i = 0; i < r.frames.size(); ++i) {
    ASSERT_EQ(Add(calibrator.get(), r, i), AddResult::kAccepted);
    delays_s[r.frames[i].stamp_ns] = s.frames[i].delay_s;
    const int64_t exposed_ns = StampAt(r.frames[i].stamp_ns, s.frames[i].delay_s + 0.02);
    for (; gyro < r.gyro.size() && r.gyro[gyro].stamp_ns <= exposed_ns; ++gyro) {
      ASSERT_EQ(Add(calibrator.get(), r.gyro[gyro]), AddResult::kAccepted);
    }
    ASSERT_TRUE(calibrator->WaitUntilIdle(60.0));
    const auto snapshot = calibrator->snapshot();
    if (!snapshot->has_estimate || i < 300) continue;
    ++estimates;
    const double error_s = snapshot->calibration.delay_s + snapshot->frame_offset_s -
                           delays_s.at(snapshot->frame_stamp_ns);
    sum_sq_s += error_s * error_s;
    sum_sq_sigmas += std::pow(error_s / snapshot->frame_offset_sigma_s, 2);
  }
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_THAT(snapshot->frame_stamps, testing::HasSubstr("arrival times"));
  EXPECT_NEAR(snapshot->frame_jitter_s, 2e-3, 0.7e-3);
  EXPECT_LT(snapshot->parameters[kDelay].sigma, 0.7e-3);
  EXPECT_EQ(estimates, 121);
  // A pair tells mostly the difference of its two frames' offsets.
  EXPECT_LT(std::sqrt(sum_sq_s / estimates), 1.2e-3);
  EXPECT_LT(sum_sq_sigmas / estimates, 1.5);  // latencies are not Gaussian
  const auto largest_error = [&](const Snapshot& of, const Snapshot& in_sigmas_of) {
    const Calibration& c = of.calibration;
    double largest = 0.0;
    for (const auto& [parameter, error] :
         {std::pair(kFocal, c.focal_px - s.truth.lens[camgyro::kFocal]),
          std::pair(kCx, c.principal_px[0] - s.truth.lens[camgyro::kCx]),
          std::pair(kCy, c.principal_px[1] - s.truth.lens[camgyro::kCy]),
          std::pair(kReadout, c.readout_s - s.truth.readout_s),
          std::pair(kDelay, c.delay_s - (s.truth.delay_s - 2e-3))}) {
      largest = std::max(largest, std::abs(error) / in_sigmas_of.parameters[parameter].sigma);
    }
    return largest;
  };
  EXPECT_LT(largest_error(*snapshot, *snapshot), 3.0);
  EXPECT_LT(snapshot->parameters[kReadout].sigma, 0.2e-3);
  VinsSettings settings;
  settings.accel_noise_m_s2_rtHz = scenario.gyro.accel_noise_density_m_s2_rtHz;
  for (const AccelSample& sample : r.accel) {
    ASSERT_EQ(Add(calibrator.get(), sample), AddResult::kAccepted);
  }
  const VinsStart start = calibrator->InitialiseVins(settings);
  EXPECT_EQ(start.verdict, VinsVerdict::kReady) << start.explanation;

  CalibratorOptions as_recorded = OptionsFor(scenario);
  as_recorded.stamps = Stamps::kRecorded;
  const auto other = Make(as_recorded);
  Feed(other.get(), r);
  ASSERT_TRUE(other->WaitUntilIdle(120.0));
  EXPECT_EQ(other->snapshot()->frame_jitter_s, 0.0);
  EXPECT_GT(largest_error(*other->snapshot(), *snapshot), 3.0);
  // It sees that its residuals are alike in neighbours: its own sigmas are larger.
  EXPECT_LT(largest_error(*other->snapshot(), *other->snapshot()), 3.0);
}

// The delay of a flight controller's stamps, which grows by 20 to 30 ms in a minute.
TEST(Calibrator, FollowsADelayThatDrifts) {
  Scenario scenario = LivelyScenario(25.0);
  scenario.effects.clock_skew.ppm = 417.0;
  scenario.effects.delay_wander.amplitude_s = 0.67e-3;
  scenario.effects.delay_wander.period_s = 60.0;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const Recording& r = s.recording;
  const auto calibrator = Make(OptionsFor(scenario));
  size_t gyro = 0;
  int estimates = 0, outside_two_sigmas = 0;
  for (size_t i = 0; i < r.frames.size(); ++i) {
    ASSERT_EQ(Add(calibrator.get(), r, i), AddResult::kAccepted);
    const int64_t exposed_ns = StampAt(r.frames[i].stamp_ns, s.frames[i].delay_s + 0.02);
    for (; gyro < r.gyro.size() && r.gyro[gyro].stamp_ns <= exposed_ns; ++gyro) {
      ASSERT_EQ(Add(calibrator.get(), r.gyro[gyro]), AddResult::kAccepted);
    }
    ASSERT_TRUE(calibrator->WaitUntilIdle(60.0));
    const auto snapshot = calibrator->snapshot();
    if (!snapshot->has_estimate || i < 450) continue;  // it needs some seconds for its start
    ++estimates;
    // A frame that has just come is not in the estimate yet.
    const double since_s = SecondsSince(snapshot->frame_stamp_ns, r.frames[i].stamp_ns);
    EXPECT_LT(since_s, 0.7);
    const double error_s = std::abs(snapshot->calibration.delay_s + snapshot->clock_skew * since_s -
                                    s.frames[i].delay_s);
    EXPECT_LT(error_s, 0.4e-3) << i;
    outside_two_sigmas += error_s > 2.0 * snapshot->parameters[kDelay].sigma;
  }
  EXPECT_EQ(estimates, 301);
  // Neighbours share their errors: a twentieth in the long run.
  EXPECT_LT(outside_two_sigmas, estimates / 6);
  EXPECT_NEAR(calibrator->snapshot()->clock_skew, 417e-6, 120e-6);
  EXPECT_EQ(calibrator->snapshot()->starts, 1);
}

TEST(Calibrator, WrongAskedPrecisionIsNotReady) {
  const Scenario scenario = LivelyScenario(7.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  CalibratorOptions options = OptionsFor(scenario);
  options.ready_delay_s = 1e-9;
  const auto calibrator = Make(options);
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate);
  EXPECT_FALSE(snapshot->ready);
  EXPECT_EQ(snapshot->parameters[kDelay].readiness, Readiness::kImprecise);
}

// A lens that bends by 4 px in the corners, and nobody has said so: f is off by far more than
// noise, and neither is it called ready.
TEST(Calibrator, WhatNobodyDeclaredIsNotReadyAndDoubted) {
  Scenario scenario = LivelyScenario(9.0);
  scenario.effects.radial_distortion.k1 = -0.06;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  CalibratorOptions options = OptionsFor(scenario);
  options.ready_focal = 0.005;
  const auto calibrator = Make(options);
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_THAT(snapshot->doubt, testing::HasSubstr("the model lacks"));
  const ParameterState& focal = snapshot->parameters[kFocal];
  const double error_px = std::abs(snapshot->calibration.focal_px - s.truth.lens[camgyro::kFocal]);
  EXPECT_GT(error_px, 5.0 * focal.sigma);
  EXPECT_LT(error_px, 3.0 * focal.sigma_total);
  EXPECT_EQ(focal.readiness, Readiness::kImprecise);
  EXPECT_FALSE(snapshot->ready);
}

// A lens that leads fits astray is taken in at the start, and in the total.
TEST(Calibrator, TakesInALensThatNobodyDeclared) {
  Scenario scenario = RoomThroughALens();
  // With others, equidistant coefficients fit as well, whose first one is another.
  scenario.seed = 2;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(600.0));
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  const Calibration& c = snapshot->calibration;
  EXPECT_NEAR(c.distortion[0], -0.28, 0.03);
  EXPECT_LT(Sigmas(c.focal_px, s.truth.lens[camgyro::kFocal], snapshot->parameters[kFocal]), 4.5);
  EXPECT_THAT(snapshot->lens, testing::HasSubstr("nothing declares"));
}

TEST(Calibrator, LeavesOutADistortionThatIsOfAnotherCamera) {
  const Scenario scenario = RoomThroughALens();
  Simulated s = simulation::SimulateTracks(scenario).value();
  CalibratorOptions options = OptionsFor(scenario);
  options.camera.focal_px = scenario.camera.focal_px;
  options.camera.distortion = {-0.10, 0.0, 0.0, 0.0};
  s.recording.frames.resize(180);  // 6 s, for the start
  s.recording.tracks.resize(180);
  const auto calibrator = Make(options);
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(600.0));
  EXPECT_THAT(calibrator->snapshot()->lens, testing::HasSubstr("is not that of this camera"));
}

// A phone in portrait, whose sensor's rows are the columns of its pictures.
TEST(Calibrator, SaysThatColumnsAreRead) {
  Scenario scenario = LivelyScenario(9.0);
  scenario.camera.width_px = 480;
  scenario.camera.height_px = 720;
  scenario.effects.readout_direction.columns = true;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  const Calibration& c = snapshot->calibration;
  EXPECT_NEAR(c.column_readout_s, 0.02, 1e-3);
  EXPECT_NEAR(c.readout_s, 0.0, 1e-3);
  EXPECT_LT(Sigmas(c.focal_px, s.truth.lens[camgyro::kFocal], snapshot->parameters[kFocal]), 4.0);
  EXPECT_LT(Sigmas(c.delay_s, s.truth.delay_s, snapshot->parameters[kDelay]), 4.0);
  EXPECT_TRUE(snapshot->doubt.empty()) << snapshot->doubt;
  // Which knows rows only.
  EXPECT_THAT(calibrator->InitialiseVins({}).explanation, testing::HasSubstr("column by column"));
}

TEST(Calibrator, WithoutMotionItSaysWhy) {
  Scenario scenario = LivelyScenario(7.0);
  scenario.motion.rotation_rms_rad_s.setConstant(1e-5);
  scenario.motion.step_nod_rad = 0.0;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  const auto snapshot = calibrator->snapshot();
  EXPECT_EQ(snapshot->stage, Stage::kCollecting);
  EXPECT_GE(snapshot->starts, 1);
  EXPECT_FALSE(snapshot->message.empty());
  EXPECT_EQ(snapshot->parameters[kDelay].readiness, Readiness::kNoEstimate);
  EXPECT_EQ(calibrator->InitialiseVins({}).verdict, VinsVerdict::kNoCalibration);
}

TEST(Calibrator, BadOptionsAreRefusedWithAReason) {
  static constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](auto change) {
    CalibratorOptions options;
    options.camera.width_px = 640;
    options.camera.height_px = 480;
    change(&options);
    std::string error;
    const bool null = Calibrator::Create(options, &error) == nullptr;
    EXPECT_EQ(null, !error.empty());
    return null;
  };
  EXPECT_FALSE(refused([](CalibratorOptions*) {}));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->camera.width_px = 0; }));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->camera.focal_px = kNan; }));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->camera.readout_s = kNan; }));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->camera.distortion[1] = kNan; }));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->camera.q_gyro_cam_wxyz = {0, 0, 0, 0}; }));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->ready_delay_s = 0.0; }));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->start_s = kNan; }));
  EXPECT_TRUE(refused([](CalibratorOptions* o) { o->max_frames_waiting = 0; }));
}

TEST(Calibrator, QueueIsBounded) {
  const Scenario scenario = LivelyScenario(8.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  CalibratorOptions options = OptionsFor(scenario);
  options.max_frames_waiting = 3;
  const auto calibrator = Make(options);
  for (const GyroSample& sample : s.recording.gyro) {
    ASSERT_EQ(Add(calibrator.get(), sample), AddResult::kAccepted);
  }
  uint64_t full = 0;
  for (size_t i = 0; i < s.recording.frames.size(); ++i) {
    full += Add(calibrator.get(), s.recording, i) == AddResult::kQueueFull;
  }
  ASSERT_TRUE(calibrator->WaitUntilIdle(120.0));
  EXPECT_GT(full, 0u);  // matching and copying take longer than feeding
  EXPECT_EQ(calibrator->snapshot()->frames + full, s.recording.frames.size());
}

// Three producers and a reader at once; what comes out is what one thread would have made.
TEST(Calibrator, ProducersAndReaderMayRunAtTheSameTime) {
  const Scenario scenario = LivelyScenario(7.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const Recording& r = s.recording;
  const auto calibrator = Make(OptionsFor(scenario));
  std::atomic<bool> done{false};
  std::atomic<int> refused{0};
  // As sensors do, no stream runs ahead of the others for long.
  constexpr int64_t kAheadNs = 200'000'000;
  constexpr int64_t kEnd = std::numeric_limits<int64_t>::max();
  std::array<std::atomic<int64_t>, 3> at_ns{};
  const auto produce = [&](size_t stream, size_t count, const auto& stamp_ns, const auto& add) {
    for (size_t i = 0; i < count; ++i) {
      at_ns[stream] = stamp_ns(i);
      while (std::any_of(at_ns.begin(), at_ns.end(),
                         [&](const auto& other) { return other < at_ns[stream] - kAheadNs; })) {
        std::this_thread::yield();
      }
      refused += add(i) != AddResult::kAccepted;
    }
    at_ns[stream] = kEnd;
  };
  std::thread gyro([&] {
    produce(
        0, r.gyro.size(), [&](size_t i) { return r.gyro[i].stamp_ns; },
        [&](size_t i) { return Add(calibrator.get(), r.gyro[i]); });
  });
  std::thread accel([&] {
    produce(
        1, r.accel.size(), [&](size_t i) { return r.accel[i].stamp_ns; },
        [&](size_t i) { return Add(calibrator.get(), r.accel[i]); });
  });
  std::thread frames([&] {
    produce(
        2, r.frames.size(), [&](size_t i) { return r.frames[i].stamp_ns; },
        [&](size_t i) { return Add(calibrator.get(), r, i); });
  });
  std::thread reader([&] {
    uint64_t before = 0;
    while (!done) {
      const auto snapshot = calibrator->snapshot();
      EXPECT_GE(snapshot->frames, before);  // snapshots do not go back
      before = snapshot->frames;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  gyro.join();
  accel.join();
  frames.join();
  EXPECT_TRUE(calibrator->WaitUntilIdle(120.0));
  done = true;
  reader.join();
  EXPECT_EQ(refused, 0);
  const auto snapshot = calibrator->snapshot();
  ASSERT_TRUE(snapshot->has_estimate) << snapshot->message;
  EXPECT_LT(Sigmas(snapshot->calibration.delay_s, s.truth.delay_s, snapshot->parameters[kDelay]),
            5.0);
}

TEST(Calibrator, MayBeDestroyedWhileItWorks) {
  const Scenario scenario = LivelyScenario(6.0);
  const Simulated s = simulation::SimulateTracks(scenario).value();
  auto calibrator = Make(OptionsFor(scenario));
  Feed(calibrator.get(), s.recording);
  calibrator.reset();
}

// Pictures instead of tracks: the sample of the repository is too long, 40 frames are enough to see
// that they are tracked and counted.
TEST(Calibrator, TakesPictures) {
  Scenario scenario = LivelyScenario(1.3);
  scenario.scene.kind = simulation::SceneKind::kRoom;
  scenario.motion.speed_m_s = 0.3;
  scenario.camera.width_px = 320;
  scenario.camera.height_px = 240;
  scenario.camera.focal_px = 290.0;
  scenario.video.max_blur_samples = 4;
  const Simulated s = simulation::SimulateSensors(scenario).value();
  simulation::Renderer renderer(s, scenario);
  const auto calibrator = Make(OptionsFor(scenario));
  for (const GyroSample& sample : s.recording.gyro) {
    ASSERT_EQ(Add(calibrator.get(), sample), AddResult::kAccepted);
  }
  const TrackPoint point = {1, 10.0, 10.0};
  for (size_t i = 0; i < s.recording.frames.size(); ++i) {
    cv::Mat picture = renderer.Render(i);
    ASSERT_EQ(calibrator->AddImage(s.recording.frames[i].stamp_ns,
                                   {picture.data, picture.cols, picture.rows, picture.step[0]}),
              AddResult::kAccepted);
    picture.setTo(0);  // it was copied
  }
  EXPECT_EQ(calibrator->AddTracks(s.recording.frames.back().stamp_ns + 1, &point, 1),
            AddResult::kOutOfRange);
  ASSERT_TRUE(calibrator->WaitUntilIdle(60.0));
  EXPECT_EQ(calibrator->snapshot()->frames, s.recording.frames.size());
  EXPECT_EQ(calibrator->snapshot()->stage, Stage::kCollecting);  // 1.3 s are too short
}

TEST(Api, NamesAndVersion) {
  EXPECT_STREQ(Version(), "0.1.0");
  EXPECT_STREQ(ParameterName(kDelay), "delay_s");
  EXPECT_STREQ(ParameterName(-1), "");
  EXPECT_STREQ(ParameterName(kParameters), "");
  EXPECT_STREQ(ToString(AddResult::kTooLate), "too late");
  EXPECT_STREQ(ToString(Readiness::kReady), "ready");
  EXPECT_STREQ(ToString(VinsVerdict::kNoAccelerometer), "no accelerometer");
}

}  // namespace
}  // namespace camgyro::api
