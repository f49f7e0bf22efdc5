// The systematic part of the error, and the word of doubt, on simulated recordings.
#include "estimator/diagnosis/model_check.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <utility>

#include "core/effects/catalogue.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

struct Calibrated {
  simulation::Simulated simulated;
  CalibrationReport report;
  std::optional<std::string> doubt;
};

// From a start that is off the truth, without an online pass.
Calibrated Check(const std::vector<std::string>& overrides, DeviceClass device) {
  auto scenario = simulation::ParseScenario(
      "duration_s: 14\nmotion: {kind: walking}\ntracks: {count: 70, noise_px: 0.5}", overrides);
  EXPECT_TRUE(scenario) << scenario.error().message;
  Calibrated c{simulation::SimulateTracks(*scenario, 3).value(), {}, {}};
  CalibrateOptions options;
  options.given_start.emplace();
  options.given_start->delay_middle_row_s = c.simulated.truth.delay_s + 0.012;
  options.given_start->q_gyro_cam = c.simulated.truth.q_gyro_cam;
  c.simulated.recording.camera.focal_px = 1.02 * c.simulated.truth.lens[kFocal];
  options.online = false;
  Result<CalibrationReport> report = CalibrateRecording(c.simulated.recording, nullptr, options);
  EXPECT_TRUE(report) << report.error().message;
  if (!report) return c;
  c.report = *std::move(report);
  c.doubt = CheckModel(c.simulated.recording, options, device, &c.report);
  return c;
}

StateVector ShareOf(const CalibrationReport& report, const std::string& effect) {
  const auto found = std::find_if(report.systematic.begin(), report.systematic.end(),
                                  [&](const EffectShare& s) { return s.effect == effect; });
  EXPECT_NE(found, report.systematic.end()) << effect;
  return found == report.systematic.end() ? StateVector::Zero().eval() : found->sigma;
}

TEST(ModelCheck, ASoundDeviceGetsATotalAndNoDoubt) {
  const Calibrated c = Check({}, DeviceClass::kPhone);
  EXPECT_FALSE(c.doubt.has_value()) << *c.doubt;
  EXPECT_EQ(c.report.device_class, "phone");
  ASSERT_TRUE(c.report.calibration.total_covariance.has_value());
  const StateVector total = *c.report.calibration.sigma_total();
  const StateVector noise = c.report.calibration.sigma();
  EXPECT_TRUE((total.array() >= noise.array()).all()) << total.transpose();
  // A gyro's scale is the focal length's: 1 % of each of two axes.
  const double focal = c.simulated.truth.lens[kFocal];
  EXPECT_GT(total[kStateFocal], 0.004 * focal);
  EXPECT_LT(total[kStateFocal], 0.02 * focal);
  EXPECT_GT(ShareOf(c.report, "gyro_scale")[kStateFocal], 0.5 * total[kStateFocal]);
  // A better gyro leaves less.
  CalibrationReport industrial = c.report;
  industrial.systematic.clear();
  CheckModel(c.simulated.recording, {}, DeviceClass::kIndustrial, &industrial);
  EXPECT_LT((*industrial.calibration.sigma_total())[kStateFocal], 0.7 * total[kStateFocal]);
}

// One and a half of a phone's usual sizes, which nobody declares: f is off by many sigmas of noise.
TEST(ModelCheck, TheTotalCoversAScaleThatNobodyDeclared) {
  const Calibrated c =
      Check({"effects.gyro_scale={error: [0.015, 0.015, -0.015]}"}, DeviceClass::kPhone);
  const Calibration& found = c.report.calibration;
  const StateVector error = Difference(found, c.simulated.truth);
  EXPECT_GT(std::abs(error[kStateFocal]), 5.0 * found.sigma()[kStateFocal]);
  ASSERT_TRUE(found.sigma_total().has_value());
  const StateVector in_totals = error.cwiseQuotient(*found.sigma_total());
  EXPECT_LT(in_totals.cwiseAbs().maxCoeff(), 3.0) << in_totals.transpose();
}

// What the residuals show beyond doubt is said, whatever the device is.
TEST(ModelCheck, SaysThatTheLensIsNotAPinhole) {
  const Calibrated c =
      Check({"effects.radial_distortion={k1: -0.15, k2: 0.03}"}, DeviceClass::kPhone);
  ASSERT_TRUE(c.doubt.has_value());
  EXPECT_THAT(*c.doubt, HasSubstr("radial_distortion"));
}

// Every row of the table is an effect that exists, in a shape that exists, with a size that is less
// than what the catalogue calls plausible.
TEST(DeviceClass, TheTableNamesEffectsOfTheCatalogue) {
  EffectSetup setup;
  setup.size_px = {720.0, 480.0};
  for (int i = 0; i < 300; ++i) {
    setup.frames.push_back(FrameTime(i / 30.0, 0.005 + 0.002 * (i % 3)));
    setup.gyro_times_s.push_back(i / 30.0);
  }
  setup.gyro_rad_s = Eigen::Matrix3Xd::Random(3, 300);
  setup.accel_times_s = setup.gyro_times_s;
  setup.accel_m_s2 = 9.8 * Eigen::Matrix3Xd::Random(3, 300);
  for (const UsualEffect& usual : UsualEffects()) {
    const EffectEntry* entry = FindEffect(usual.effect);
    ASSERT_NE(entry, nullptr) << usual.effect;
    const auto effect = entry->make(setup, usual.shape);
    EXPECT_GT(std::string(usual.source).size(), 10u);
    if (effect == nullptr) continue;  // this setup's gyro is too slow for derivatives
    for (const EffectParameter& p : effect->parameters()) {
      for (const double sigma : usual.sigma) {
        EXPECT_GT(sigma, 0.0) << usual.effect;
        EXPECT_LE(3.0 * sigma, 3.0 * p.spread) << usual.effect << " " << p.name;
        EXPECT_LE(2.0 * sigma, p.plausible_max) << usual.effect << " " << p.name;
      }
    }
  }
  for (const auto device :
       {DeviceClass::kPhone, DeviceClass::kActionCamera, DeviceClass::kIndustrial}) {
    EXPECT_EQ(DeviceClassOf(DeviceClassName(device)).value(), device);
  }
  EXPECT_FALSE(DeviceClassOf("toaster").has_value());
}

}  // namespace
}  // namespace camgyro
