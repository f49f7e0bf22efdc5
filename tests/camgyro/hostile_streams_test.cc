// Streams as no simulator makes them and loggers do: whatever comes, there is a result with finite
// numbers or an error that says why; never a failed check, NaN or exception.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "camgyro/calibrator.h"
#include "core/time.h"
#include "estimator/calibrate.h"
#include "estimator/window/sliding_window.h"
#include "frontend/camera_rotations.h"
#include "frontend/readers/repair_stamps.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

constexpr double kGyroRates[] = {25.0, 50.0, 100.0, 200.0, 500.0, 1000.0};
constexpr double kFrameRates[] = {5.0, 10.0, 30.0, 60.0, 120.0, 240.0};

class Hostile {
 public:
  explicit Hostile(unsigned seed) : random_(seed) {
    simulation::Scenario scenario;
    scenario.seed = seed;
    scenario.gyro.rate_hz = kGyroRates[seed % 6];
    scenario.camera.rate_hz = kFrameRates[(seed / 6 + seed) % 6];
    scenario.camera.readout_s = 0.6 / scenario.camera.rate_hz;
    scenario.duration_s = std::min(6.0, 400.0 / scenario.camera.rate_hz);
    scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
    scenario.tracks.count = 25;
    scenario.tracks.noise_px = Maybe(0.2) ? 0.0 : 0.5;
    recording = simulation::SimulateTracks(scenario).value().recording;
    if (Maybe(0.5)) ArriveLate(1e-3 * std::exp(4.0 * Uniform()), &recording.gyro);
    if (Maybe(0.5)) ArriveLate(1e-3 * std::exp(3.0 * Uniform()), &recording.frames);
    while (Maybe(0.6)) DropSpan(&recording.gyro);
    while (Maybe(0.5)) DropFrames();
    if (Maybe(0.3)) LensCap();
    if (Maybe(0.2)) Rest();
    if (Maybe(0.2)) Shift();
  }

  bool Maybe(double probability) { return Uniform() < probability; }
  double Uniform() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }

  Recording recording;

 private:
  template <typename Stamped>
  void ArriveLate(double latency_s, std::vector<Stamped>* items) {
    int64_t last_ns = std::numeric_limits<int64_t>::min();
    for (Stamped& item : *items) {
      const double late_s = latency_s * (Maybe(0.01) ? 30.0 : -std::log(1.0 - Uniform()));
      item.stamp_ns = last_ns = std::max(last_ns + 1, StampAt(item.stamp_ns, late_s));
    }
  }
  template <typename Stamped>
  std::pair<size_t, size_t> Span(const std::vector<Stamped>& items, double most) {
    const size_t begin = static_cast<size_t>(Uniform() * static_cast<double>(items.size() - 1));
    const double length = most * Uniform() * Uniform() * static_cast<double>(items.size());
    return {begin, std::min(items.size(), begin + 1 + static_cast<size_t>(length))};
  }
  void DropSpan(std::vector<GyroSample>* gyro) {
    const auto [begin, end] = Span(*gyro, 0.5);
    if (gyro->size() - (end - begin) < 10) return;
    gyro->erase(gyro->begin() + static_cast<std::ptrdiff_t>(begin),
                gyro->begin() + static_cast<std::ptrdiff_t>(end));
  }
  void DropFrames() {
    const auto [begin, end] = Span(recording.frames, 0.4);
    if (recording.frames.size() - (end - begin) < 10) return;
    const auto b = static_cast<std::ptrdiff_t>(begin), e = static_cast<std::ptrdiff_t>(end);
    recording.frames.erase(recording.frames.begin() + b, recording.frames.begin() + e);
    recording.tracks.erase(recording.tracks.begin() + b, recording.tracks.begin() + e);
  }
  void LensCap() {  // nothing to see, then the same few points that do not move
    const auto [begin, end] = Span(recording.frames, 0.9);
    for (size_t i = begin; i < end; ++i) recording.tracks[i].clear();
    const auto [again, last] = Span(recording.frames, 0.5);
    for (size_t i = again; i < last; ++i) recording.tracks[i] = recording.tracks[again];
  }
  void Rest() {
    const auto [begin, end] = Span(recording.gyro, 0.9);
    for (size_t i = begin; i < end; ++i) recording.gyro[i].omega_gyro_rad_s.setZero();
  }
  void Shift() {
    for (GyroSample& sample : recording.gyro) sample.stamp_ns += 1'800'000'000;
  }

  std::mt19937 random_;
};

void ExpectFinite(const Calibration& c) {
  EXPECT_TRUE(c.lens.allFinite() && c.bias_gyro_rad_s.allFinite() && c.covariance.allFinite());
  EXPECT_TRUE(std::isfinite(c.readout_s) && std::isfinite(c.delay_s));
  EXPECT_NEAR(c.q_gyro_cam.norm(), 1.0, 1e-6);
  EXPECT_TRUE((c.covariance.diagonal().array() >= 0.0).all());
}

class HostileStreams : public testing::TestWithParam<int> {};

TEST_P(HostileStreams, CalibrateAnswers) {
  Hostile hostile(static_cast<unsigned>(GetParam()));
  Recording& recording = hostile.recording;
  RepairStamps(hostile.Maybe(0.5) ? StampsMode::kAuto : StampsMode::kRepaired, &recording);
  for (size_t i = 1; i < recording.gyro.size(); ++i) {
    ASSERT_GT(recording.gyro[i].stamp_ns, recording.gyro[i - 1].stamp_ns);
  }
  const std::vector<FramePair> pairs = PairsForRotations(recording);
  const Result<CalibrationReport> report =
      CalibrateRecording(recording,
                         [&](const Recording& now, const std::vector<RotationTrial>& trials) {
                           return CameraRotationsOf(now, pairs, trials);
                         },
                         {});
  if (report) {
    ExpectFinite(report->calibration);
  } else {
    EXPECT_FALSE(report.error().message.empty());
    EXPECT_NE(report.error().kind, ErrorKind::kBadUsage);
  }
}

// Gyro and frames in any order, the start as wrong as it comes.
TEST_P(HostileStreams, WindowAnswers) {
  Hostile hostile(static_cast<unsigned>(100 + GetParam()));
  const Recording& recording = hostile.recording;
  StartResult start;
  start.focal.emplace().value_px = 400.0 + 500.0 * hostile.Uniform();
  start.delay_middle_row_s = 0.1 * (hostile.Uniform() - 0.5);
  start.q_gyro_cam = Eigen::Quaterniond::UnitRandom();
  const Prior prior = MakePrior(recording, start);
  SlidingWindow window(prior.mean, prior, recording.gyro.front().stamp_ns, {});
  const std::vector<FramePair> pairs = PairsFromTracks(recording.tracks, 1);
  size_t gyro = 0;
  for (const FramePair& pair : pairs) {
    const double ahead_s = 0.5 * (hostile.Uniform() - 0.3);
    const Frame& a = recording.frames[static_cast<size_t>(pair.frame_a)];
    const Frame& b = recording.frames[static_cast<size_t>(pair.frame_b)];
    const int64_t until_ns = StampAt(b.stamp_ns, ahead_s);
    for (; gyro < recording.gyro.size() && recording.gyro[gyro].stamp_ns < until_ns; ++gyro) {
      EXPECT_EQ(window.AddGyroSample(recording.gyro[gyro], hostile.Maybe(0.01)),
                AddResult::kAccepted);
    }
    (void)window.AddPair(a.stamp_ns, b.stamp_ns, pair.matches);
  }
  EXPECT_EQ(window.AddGyroSample(
                {recording.gyro.back().stamp_ns + 1'000'000'000, {std::nan(""), 0.0, 0.0}}),
            AddResult::kNotFinite);
  if (window.num_used_pairs() > 0) ExpectFinite(window.latest().estimate);
}

TEST_P(HostileStreams, LibraryAnswers) {
  Hostile hostile(static_cast<unsigned>(200 + GetParam()));
  const Recording& recording = hostile.recording;
  api::CalibratorOptions options;
  options.camera.width_px = recording.camera.width_px;
  options.camera.height_px = recording.camera.height_px;
  options.max_frames_waiting = 10'000;
  options.start_s = 2.0;
  std::string error;
  const auto calibrator = api::Calibrator::Create(options, &error);
  ASSERT_NE(calibrator, nullptr) << error;
  size_t gyro = 0, frame = 0;
  while (gyro < recording.gyro.size() || frame < recording.frames.size()) {
    const bool take_gyro =
        frame == recording.frames.size() ||
        (gyro < recording.gyro.size() && hostile.Uniform() < 0.99 &&
         recording.gyro[gyro].stamp_ns <= StampAt(recording.frames[frame].stamp_ns, 0.2));
    if (take_gyro) {
      const GyroSample& s = recording.gyro[gyro++];
      const Eigen::Vector3d& w = s.omega_gyro_rad_s;
      (void)calibrator->AddGyro(s.stamp_ns, w.x(), w.y(), w.z());
    } else {
      std::vector<api::TrackPoint> points;
      for (const TrackedPoint& p : recording.tracks[frame]) {
        points.push_back({p.track_id, p.px.x(), p.px.y()});
      }
      (void)calibrator->AddTracks(recording.frames[frame++].stamp_ns, points.data(), points.size());
    }
  }
  ASSERT_TRUE(calibrator->WaitUntilIdle(300.0));
  const auto snapshot = calibrator->snapshot();
  EXPECT_NE(snapshot->stage, api::Stage::kStopped) << snapshot->message;
  if (snapshot->has_estimate) {
    for (const double value : snapshot->calibration.covariance) EXPECT_TRUE(std::isfinite(value));
    EXPECT_TRUE(std::isfinite(snapshot->calibration.delay_s));
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, HostileStreams, testing::Range(0, 12));

}  // namespace
}  // namespace camgyro
