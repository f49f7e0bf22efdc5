// Simulations that are driven by a device's own log, with logs written here.
#include "simulation/device_log.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/so3.h"
#include "simulation/scenario.h"
#include "simulation/simulate.h"

namespace camgyro::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr int64_t kFirstNs = 97'000'000'123'000;
constexpr double kDelayS = 0.4;

Vector3d RateAt(double t) {
  return {0.6 * std::sin(5.0 * t), 0.5 * std::cos(4.0 * t), 0.3 * std::sin(3.0 * t + 1.0)};
}
Vector2d ShiftAt(double t) { return {40.0 * std::sin(9.0 * t), 30.0 * std::cos(7.0 * t)}; }

class DeviceLogTest : public ::testing::Test {
 protected:
  // 4 s: a gyro of about 200 Hz with a gap, frames with one missing on a clock that begins with the
  // gyro's first sample, and a lens that is logged twice and out of order.
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
    std::string gyro = "timestamp_ns,wx,wy,wz\n", frames = "frame,timestamp_s,exposure_s\n";
    for (int i = 0; i < 800; ++i) {
      if (i > 400 && i < 410) continue;
      const int64_t stamp_ns = kFirstNs + int64_t{5'000'000} * i + (i > 0 ? 1000 * (i % 7) : 0);
      gyro_ns_.push_back(stamp_ns - kFirstNs);
      const Vector3d rate = RateAt(1e-9 * static_cast<double>(gyro_ns_.back()));
      gyro += Row(stamp_ns, rate);
    }
    for (int i = 0; i < 110; ++i) {
      if (i == 50) continue;
      frame_ns_.push_back(int64_t{33'333'000} * i);
      frames += std::to_string(i) + "," + std::to_string(1e-9 * double(frame_ns_.back())) + "," +
                std::to_string(0.002 + 1e-5 * i) + "\n";
    }
    std::string lens = "timestamp_ns,frame,ois_x,ois_y\n";
    for (int i = 0; i < 1000; ++i) {
      for (const int twice : {i, std::max(0, i - 3)}) {
        const int64_t stamp_ns = kFirstNs + int64_t{4'000'000} * twice;
        const Vector2d shift = ShiftAt(0.004 * twice);
        lens += std::to_string(stamp_ns) + ",0," + std::to_string(shift.x()) + "," +
                std::to_string(shift.y()) + "\n";
      }
    }
    Write("gyro.csv", gyro);
    Write("frames.csv", frames);
    Write("lens.csv", lens);
  }

  static std::string Row(int64_t stamp_ns, const Vector3d& v) {
    return std::to_string(stamp_ns) + "," + std::to_string(v.x()) + "," + std::to_string(v.y()) +
           "," + std::to_string(v.z()) + "\n";
  }

  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  Result<Scenario> Load(std::vector<std::string> overrides) const {
    Write("scenario.yaml",
          "camera: {delay_s: 0.4}\ntracks: {noise_px: 0}\n"
          "gyro: {noise_density_rad_s_rtHz: 0, bias_rad_s: [0, 0, 0], bias_walk_rad_s2_rtHz: 0}\n"
          "log: {gyro: gyro.csv, frames: frames.csv}\n");
    return LoadScenario((folder_ / "scenario.yaml").string(), overrides);
  }

  std::filesystem::path folder_;
  std::vector<int64_t> gyro_ns_, frame_ns_;  // after the first gyro sample
};

TEST_F(DeviceLogTest, TurnsAndSamplesAsTheDeviceDid) {
  const Scenario scenario = Load({}).value();
  const Simulated s = SimulateTracks(scenario).value();
  ASSERT_EQ(s.recording.gyro.size(), gyro_ns_.size());
  for (size_t i = 0; i < gyro_ns_.size(); ++i) {
    ASSERT_EQ(s.recording.gyro[i].stamp_ns - scenario.start_ns, gyro_ns_[i]);
    // The spline smooths, and has a corner where the log begins, has its gap and ends.
    const double t = 1e-9 * static_cast<double>(gyro_ns_[i]);
    if (t < 0.1 || t > 3.9 || std::abs(t - 2.03) < 0.1) continue;
    ASSERT_NEAR((s.recording.gyro[i].omega_gyro_rad_s - RateAt(t)).norm(), 0.0, 2e-3) << t;
  }
  // Frames that the gyro covers with half a second to spare, at the log's times.
  std::vector<int64_t> expected;
  for (const int64_t time_ns : frame_ns_) {
    const double t = 1e-9 * static_cast<double>(time_ns) + kDelayS;
    if (t >= 0.5 && t <= 1e-9 * static_cast<double>(gyro_ns_.back()) - 0.5) {
      expected.push_back(time_ns);
    }
  }
  ASSERT_EQ(s.recording.frames.size(), expected.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(s.recording.frames[i].stamp_ns - scenario.start_ns, expected[i]);
    EXPECT_NEAR(s.recording.frames[i].exposure_s, 0.002 + 3e-10 * double(expected[i]) / 1e3, 1e-4);
  }
  EXPECT_NEAR(scenario.gyro.rate_hz, 200.0, 0.1);
  EXPECT_NEAR(scenario.camera.rate_hz, 30.0, 0.01);
  // And moves as the scenario says.
  const CameraState state = s.camera->trajectory().At(1.0);
  EXPECT_NEAR(state.v_world_m_s.norm(), scenario.motion.speed_m_s, 0.5);
}

TEST_F(DeviceLogTest, MovesTheLensAsItWasLogged) {
  const Scenario scenario =
      Load({"log.lens_shift=lens.csv", "effects.optical_stabilisation.logged_px=0.25"}).value();
  const Simulated s = SimulateSensors(scenario).value();
  for (const double t : {0.7, 1.3, 2.9}) {
    EXPECT_NEAR((s.camera->StabiliserShift(t) - 0.25 * ShiftAt(t)).norm(), 0.0, 5e-3) << t;
  }
  EXPECT_THAT(ActiveEffects(scenario.effects), ::testing::ElementsAre("optical_stabilisation"));
}

// On the camera's clock, for all frames.
TEST_F(DeviceLogTest, LogsItsLens) {
  const Scenario scenario = Load({"log.lens_shift=lens.csv",
                                  "effects.optical_stabilisation={logged_px: 0.25, log_hz: 200}"})
                                .value();
  const Simulated s = SimulateSensors(scenario).value();
  const std::vector<LensSample>& samples = s.recording.lens_shift;
  ASSERT_GT(samples.size(), 400u);
  EXPECT_LT(samples.front().stamp_ns, s.recording.frames.front().stamp_ns);
  EXPECT_GT(samples.back().stamp_ns, s.recording.frames.back().stamp_ns);
  for (const size_t i : {size_t{0}, samples.size() / 2}) {
    EXPECT_EQ(samples[i + 1].stamp_ns - samples[i].stamp_ns, 5'000'000);
    const double time_s =
        1e-9 * static_cast<double>(samples[i].stamp_ns - scenario.start_ns) + kDelayS;
    EXPECT_LT((samples[i].shift_px - s.camera->StabiliserShift(time_s)).norm(), 1e-5);
  }
  EXPECT_TRUE(
      SimulateSensors(Load({"log.lens_shift=lens.csv"}).value())->recording.lens_shift.empty());
}

TEST_F(DeviceLogTest, RefusesWhatIsNoLog) {
  const auto message = [&](std::vector<std::string> overrides) {
    const Result<Scenario> scenario = Load(std::move(overrides));
    return scenario ? "" : scenario.error().message;
  };
  EXPECT_THAT(message({"log.gyro=\"\""}), HasSubstr("log.gyro: is missing"));
  EXPECT_THAT(message({"motion.kind=file", "motion.file=x.txt"}), HasSubstr("leave one of them"));
  EXPECT_THAT(message({"effects.optical_stabilisation.logged_px=1"}),
              HasSubstr("log.lens_shift: is missing"));
  EXPECT_THAT(message({"log.gyro=none.csv"}), HasSubstr("none.csv"));
  EXPECT_THAT(message({"margin_s=2"}), HasSubstr("shorter than twice margin_s"));
  Write("gyro.csv", "timestamp_ns,wx,wy\n1,0,0\n");
  EXPECT_THAT(message({}), HasSubstr("wz"));
  Write("gyro.csv", "timestamp_ns,wx,wy,wz\n5000,0,0,0\n4000,0,0,0\n");
  EXPECT_THAT(message({}), HasSubstr("gyro.csv:3: the time does not increase"));
  Write("gyro.csv", "timestamp_ns,wx,wy,wz\n5000,0,0,0\n6000,0,0,0\n");
  EXPECT_THAT(message({}), HasSubstr("has 2 rows, expected at least 20"));
}

}  // namespace
}  // namespace camgyro::simulation
