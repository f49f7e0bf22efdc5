// One device from the reports of its recordings.
#include "pipeline/device.h"

#include <gmock/gmock.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>

#include "pipeline/read_calibration.h"

namespace camgyro {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kSigma[kStateSize] = {0.5,  0.8,  0.7,  1e-4, 5e-5, 5e-4,
                                       5e-4, 5e-4, 1e-3, 1e-3, 1e-3};

// A recording of a device with f 600 px, readout 20 ms; its delay is `delay_s`.
CalibrationReport Report(unsigned seed, double delay_s) {
  CalibrationReport report;
  Calibration& c = report.calibration;
  c.width_px = 720;
  c.height_px = 480;
  c.lens = MakePinhole(600.0, {360.0, 240.0});
  c.readout_s = 0.02;
  c.delay_s = delay_s;
  c.q_gyro_cam = Eigen::Quaterniond(0.0, -0.7, 0.7, 0.1).normalized();
  report.prior.mean = c;
  report.prior.sigma << 150.0, 20.0, 20.0, 0.02, 0.05, 0.1, 0.1, 0.1, 0.15, 0.15, 0.15;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  StateVector error;
  for (int i = 0; i < kStateSize; ++i) error[i] = kSigma[i] * normal(random);
  c = Moved(c, error);
  for (int i = 0; i < kStateSize; ++i) c.covariance(i, i) = kSigma[i] * kSigma[i];
  c.determined.fill(true);
  StateVector shift = StateVector::Zero();
  shift[kStateFocal] = 4.0;
  c.total_covariance = StateCovariance(c.covariance + shift * shift.transpose());
  report.device_class = "phone";
  report.systematic = {{"gyro_scale", shift}};
  return report;
}

Result<DeviceReport> Combined(const std::vector<CalibrationReport>& reports) {
  std::vector<const CalibrationReport*> pointers;
  std::vector<std::string> names;
  for (const CalibrationReport& report : reports) {
    pointers.push_back(&report);
    names.push_back(std::string(1, static_cast<char>('a' + names.size())));
  }
  return CombineToDevice(names, pointers, /*attitudes=*/false);
}

TEST(Device, SharesLensReadoutAndMountingButNotTheDelay) {
  const auto device =
      Combined({Report(1, 0.010), Report(2, 0.030), Report(3, 0.020), Report(4, 0.020)});
  ASSERT_TRUE(device.has_value()) << device.error().message;
  const Calibration& c = device->report.calibration;
  const StateVector sigma = c.sigma();
  for (const int i : {0, 1, 2, 3, 8, 9, 10}) {
    EXPECT_LT(sigma[i], 0.55 * kSigma[i]) << i;  // 1/2 with four, and a little for the spread
    EXPECT_GT(sigma[i], 0.49 * kSigma[i]) << i;
  }
  EXPECT_NEAR(c.lens[kFocal], 600.0, 4.0 * sigma[kStateFocal]);
  EXPECT_NEAR(c.delay_s, 0.020, 1e-3);
  const StateVector total = *c.sigma_total();
  EXPECT_GT(total[kStateFocal], 4.0);
  EXPECT_NEAR(total[kStateDelay], 0.008 * std::sqrt(1.25), 2e-3);  // of the next recording
  EXPECT_EQ(device->report.systematic.back().effect, "between_recordings");
  EXPECT_THAT(device->combined.odd, testing::IsEmpty());
}

TEST(Device, NamesARecordingWithAnotherFocus) {
  std::vector<CalibrationReport> reports;
  for (unsigned i = 0; i < 5; ++i) reports.push_back(Report(10 + i, 0.01));
  reports[2].calibration.lens[kFocal] += 12.0;
  const auto device = Combined(reports);
  ASSERT_TRUE(device.has_value());
  ASSERT_EQ(device->combined.odd.size(), 1u);
  EXPECT_EQ(device->combined.odd[0].recording, 2u);
  EXPECT_EQ(device->combined.odd[0].parameter, kStateFocal);
  EXPECT_GT((*device->report.calibration.sigma_total())[kStateFocal], 4.4);
}

TEST(Device, RefusesTwoCameras) {
  CalibrationReport other = Report(2, 0.01);
  other.calibration.width_px = 640;
  auto device = Combined({Report(1, 0.01), other});
  ASSERT_FALSE(device.has_value());
  EXPECT_EQ(device.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(device.error().message, HasSubstr("b: expected the camera of a, 720 x 480"));
  other = Report(2, 0.01);
  other.calibration.lens[kAspect] = 1.1;
  device = Combined({Report(1, 0.01), other});
  ASSERT_FALSE(device.has_value());
  EXPECT_THAT(device.error().message, HasSubstr("another distortion or aspect ratio"));
}

// A fitted effect of the device is combined; one of a recording is not.
TEST(Device, CombinesFittedEffectsOfTheDevice) {
  EffectSetup setup;
  setup.size_px = {720.0, 480.0};
  setup.frames = {FrameTime(0.0), FrameTime(10.0)};
  setup.gyro =
      std::make_shared<SensorSamples>(SensorSamples{{0.0, 10.0}, Eigen::Matrix3Xd::Zero(3, 2)});
  std::vector<CalibrationReport> reports;
  for (unsigned i = 0; i < 4; ++i) {
    reports.push_back(Report(20 + i, 0.01));
    Calibration& c = reports.back().calibration;
    auto effects = MakeEffects("clock_skew,aspect_ratio", setup);
    ASSERT_TRUE(effects.has_value()) << effects.error().message;
    c.effects = std::make_shared<EffectSet>(*effects);
    c.effect_values = Eigen::VectorXd::Zero(c.effects->size());
    c.effect_covariance = Eigen::MatrixXd::Identity(c.effects->size(), c.effects->size());
    for (const EffectSet::Item& item : c.effects->items()) {
      if (item.entry->name != "aspect_ratio") continue;
      c.effect_values[item.first] = 0.01;
      c.effect_covariance(item.first, item.first) = 1e-6;
    }
  }
  const auto device = Combined(reports);
  ASSERT_TRUE(device.has_value()) << device.error().message;
  const Calibration& c = device->report.calibration;
  ASSERT_TRUE(c.effects != nullptr);
  ASSERT_EQ(c.effects->items().size(), 1u);
  EXPECT_EQ(c.effects->items()[0].entry->name, "aspect_ratio");
  EXPECT_NEAR(c.effect_values[0], 0.01, 1e-4);
  EXPECT_NEAR(std::sqrt(c.effect_covariance(0, 0)), 0.5e-3, 1e-5);
}

TEST(Device, ItsFileIsReadBack) {
  const auto device = Combined({Report(1, 0.010), Report(2, 0.030), Report(3, 0.020)});
  ASSERT_TRUE(device.has_value());
  const auto path = std::filesystem::temp_directory_path() /
                    ("camgyro_device_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(path) << DeviceYaml(*device);
  const Result<Calibration> read = ReadCalibration(path.string());
  const YAML::Node yaml = YAML::LoadFile(path.string());
  std::filesystem::remove(path);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  const Calibration& c = device->report.calibration;
  EXPECT_LT(Difference(*read, c).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((read->sigma() - c.sigma()).cwiseQuotient(c.sigma()).cwiseAbs().maxCoeff(), 1e-8);
  ASSERT_TRUE(read->sigma_total().has_value());
  EXPECT_THAT(yaml["recordings"]["names"].as<std::vector<std::string>>(),
              ElementsAre("a", "b", "c"));
  const YAML::Node delay = yaml["recordings"]["parameters"][static_cast<int>(kStateDelay)];
  EXPECT_EQ(delay["name"].as<std::string>(), "delay_s");
  EXPECT_FALSE(delay["shared"].as<bool>());
  EXPECT_NEAR(delay["between"].as<double>(), 0.010, 1e-3);
  EXPECT_EQ(delay["values"].size(), 3u);
}

}  // namespace
}  // namespace camgyro
