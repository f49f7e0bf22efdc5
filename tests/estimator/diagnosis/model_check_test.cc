// The systematic part of the error, and the word of doubt, on simulated recordings.
#include "estimator/diagnosis/model_check.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/effects/catalogue.h"
#include "estimator/diagnosis/unseen_parallax.h"
#include "estimator/halves.h"
#include "frontend/readers/read_recording.h"
#include "tests/estimator/simulated_input.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

struct Calibrated {
  simulation::Simulated simulated;
  CalibrationReport report;
  std::optional<std::string> doubt;
  StateCovariance before;  // CheckModel
};

// From a start that is off the truth, without an online pass.
Calibrated Check(const std::vector<std::string>& overrides, DeviceClass device,
                 const std::string& effects = "") {
  auto scenario = simulation::ParseScenario(
      "duration_s: 14\nmotion: {kind: walking}\ntracks: {count: 70, noise_px: 0.5}", overrides);
  EXPECT_TRUE(scenario) << scenario.error().message;
  Calibrated c{simulation::SimulateTracks(*scenario, 3).value(), {}, {}, {}};
  CalibrateOptions options;
  options.given_start.emplace();
  options.given_start->delay_middle_row_s = c.simulated.truth.delay_s + 0.012;
  options.given_start->q_gyro_cam = c.simulated.truth.q_gyro_cam;
  c.simulated.recording.camera.focal_px = 1.02 * c.simulated.truth.lens[kFocal];
  options.online = false;
  options.effects = effects;
  Result<CalibrationReport> report = CalibrateRecording(c.simulated.recording, nullptr, options);
  EXPECT_TRUE(report) << report.error().message;
  if (!report) return c;
  c.report = *std::move(report);
  c.before = c.report.calibration.covariance;
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
  // No effect has more than the whole, whatever the data confuse it with.
  for (const EffectShare& share : c.report.systematic) {
    EXPECT_TRUE((share.sigma.array() <= total.array()).all()) << share.effect;
  }
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

// An online estimate is judged by its last seconds alone. Where their fit is elsewhere, by more
// than their noise, it may be off by as much.
TEST(ModelCheck, TheTotalCoversTheWayToTheFitOfTheData) {
  const Calibrated c = Check({}, DeviceClass::kPhone);
  const StateVector fitted = *c.report.calibration.sigma_total();
  const auto total_of = [&](double away_s, FittedTo fitted_to) {
    CalibrationReport online = c.report;
    online.systematic.clear();
    online.calibration.delay_s += away_s;
    CheckModel(c.simulated.recording, {}, DeviceClass::kPhone, &online, fitted_to);
    return *online.calibration.sigma_total();
  };
  // At the fit, and off it by what is noise: as if it were that of these data.
  const double noise_s = c.report.calibration.sigma()[kStateDelay];
  EXPECT_TRUE(total_of(0.0, FittedTo::kMoreData).isApprox(fitted, 1e-2));
  EXPECT_TRUE(total_of(noise_s, FittedTo::kMoreData).isApprox(fitted, 1e-2));
  const double away_s = 5.0 * fitted[kStateDelay];
  const StateVector off = total_of(away_s, FittedTo::kMoreData);
  EXPECT_GT(off[kStateDelay], 0.8 * away_s);
  EXPECT_LT(off[kStateDelay], 1.2 * std::hypot(away_s, fitted[kStateDelay]));
  EXPECT_LT(off[kStateFocal], 1.1 * fitted[kStateFocal]);
  EXPECT_LT(total_of(away_s, FittedTo::kTheseData)[kStateDelay], 0.5 * away_s);
}

// Too short for stretches that scatter: what effects may add is there all the same.
TEST(ModelCheck, AShortRecordingHasATotalAndNoDoubt) {
  const Calibrated c =
      Check({"duration_s=1.5", "effects.gyro_scale={error: [0.015, 0.015, -0.015]}"},
            DeviceClass::kPhone);
  EXPECT_FALSE(c.doubt.has_value()) << *c.doubt;
  const Calibration& found = c.report.calibration;
  ASSERT_TRUE(found.sigma_total().has_value());
  const StateVector total = *found.sigma_total();
  EXPECT_GT(ShareOf(c.report, "gyro_scale")[kStateFocal], 0.003 * found.lens[kFocal]);
  const StateVector in_totals = Difference(found, c.simulated.truth).cwiseQuotient(total);
  EXPECT_LT(in_totals.cwiseAbs().maxCoeff(), 3.0) << in_totals.transpose();
}

// Of things that are far, and about equally far, a step sideways looks like a turn: the fit takes
// one for the other in all pairs alike.
TEST(ModelCheck, TheTotalCoversTurnsThatAreSteps) {
  const auto share = [](const Calibrated& c) {
    return ShareOf(c.report, kUnseenParallax).segment<3>(kStateBias).maxCoeff();
  };
  const auto bias_in = [](const Calibrated& c, const StateVector& sigma) {
    return Difference(c.report.calibration, c.simulated.truth)
        .cwiseQuotient(sigma)
        .segment<3>(kStateBias)
        .cwiseAbs()
        .maxCoeff();
  };
  const auto at_depths = [](const std::string& depths, double duration_s) {
    return Check({"motion.kind=handheld", "scene.depth_law=uniform", "scene.depth_m=" + depths,
                  "duration_s=" + std::to_string(duration_s)},
                 DeviceClass::kPhone);
  };
  // So short that the frames of a pair are near each other.
  const Calibrated far = at_depths("[45, 55]", 7.0);
  EXPECT_GT(bias_in(far, far.report.calibration.sigma()), 5.0);
  ASSERT_TRUE(far.report.calibration.sigma_total());
  EXPECT_LT(bias_in(far, *far.report.calibration.sigma_total()), 3.0);
  EXPECT_THAT(far.report.notes, testing::Contains(HasSubstr("looks like a turn")));
  // Other depths tell which it was, far ones in pairs that are far apart.
  for (const char* depths : {"[1.5, 20]", "[30, 300]"}) {
    SCOPED_TRACE(depths);
    const Calibrated one = at_depths(depths, 14.0);
    EXPECT_LT(share(one), 0.3 * share(far));
    EXPECT_LT(bias_in(one, *one.report.calibration.sigma_total()), 3.0);
  }
}

bool SaysThatHalvesDisagree(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(),
                     [](const std::string& w) { return w.rfind(kHalvesDoubt, 0) == 0; });
}

// Two crystals 100 ppm apart let the halves' delays differ by many sigmas: that is in the total,
// and mostly not in the noise.
TEST(ModelCheck, WhatUsualEffectsMakeOfTheHalvesIsNotNoise) {
  const Calibrated c = Check({"effects.clock_skew={ppm: 100}"}, DeviceClass::kPhone);
  ASSERT_GT(c.report.halves_chi2, kHalvesLimit);
  const auto words = c.report.doubts.empty() ? c.report.notes : c.report.doubts;
  EXPECT_TRUE(SaysThatHalvesDisagree(words));
  EXPECT_THAT(words, testing::Contains(HasSubstr("where effects of a usual device make")));
  // Divided by what is expected, at most down to what it was.
  const double factor = c.report.calibration.covariance(0, 0) / c.before(0, 0);
  EXPECT_LT(factor, 0.7);
  EXPECT_GE(factor, 1.0 / c.report.halves_chi2);
  EXPECT_GT((*c.report.calibration.sigma_total())[kStateDelay],
            1.5 * c.report.calibration.sigma()[kStateDelay]);
}

// What they do not explain stays in both, with the doubt; and all of it stays where the motion has
// left something undetermined.
TEST(ModelCheck, WhatUsualEffectsDoNotExplainOfTheHalvesIsNoise) {
  const Calibrated clean = Check({}, DeviceClass::kPhone);
  const Eigen::MatrixXd noise = clean.report.calibration.covariance;
  CalibrationReport apart = clean.report;
  apart.halves_chi2 = 1000.0;
  apart.calibration.covariance *= 1000.0;
  apart.doubts = {std::string(kHalvesDoubt) + " (by hand)"};
  apart.systematic.clear();
  CalibrationReport undetermined = apart;
  undetermined.calibration.determined[kStateReadout] = false;

  CheckModel(clean.simulated.recording, {}, DeviceClass::kIndustrial, &apart);
  EXPECT_TRUE(SaysThatHalvesDisagree(apart.doubts));
  EXPECT_GT(apart.calibration.covariance.trace(), 30.0 * noise.trace());
  EXPECT_LT(apart.calibration.covariance.trace(), 1000.0 * noise.trace());
  CheckModel(clean.simulated.recording, {}, DeviceClass::kIndustrial, &undetermined);
  EXPECT_NEAR(undetermined.calibration.covariance.trace(), 1000.0 * noise.trace(),
              1e-9 * 1000.0 * noise.trace());
  EXPECT_THAT(undetermined.doubts, testing::ElementsAre(HasSubstr("by hand")));
}

// What the residuals show beyond doubt is said, whatever the device is.
TEST(ModelCheck, SaysThatTheLensIsNotAPinhole) {
  const Calibrated c =
      Check({"effects.radial_distortion={k1: -0.15, k2: 0.03}"}, DeviceClass::kPhone);
  ASSERT_TRUE(c.doubt.has_value());
  EXPECT_THAT(*c.doubt, HasSubstr("radial_distortion"));
}

// A wide lens, of which the series that is fitted explains a part: that it is the lens is known.
TEST(ModelCheck, SaysThatAnEffectIsOfAnotherShape) {
  const Calibrated c =
      Check({"camera.focal_px=390", "tracks.count=100", "effects.radial_distortion.model=kb4",
             "effects.radial_distortion.k1=0.02", "effects.radial_distortion.k2=-0.01"},
            DeviceClass::kPhone, "radial_distortion:radtan");
  ASSERT_TRUE(c.doubt.has_value());
  EXPECT_THAT(*c.doubt,
              HasSubstr("radial_distortion of another shape than is fitted (kannala_brandt)"));
}

// All that a phone usually has, fitted with its usual sizes as priors, although nobody declared it:
// the errors are smaller, and nothing is left of which the total could have more.
TEST(ModelCheck, UsualEffectsThatAreFittedLeaveNothingForTheTotal) {
  const std::vector<std::string> device = {
      "effects.gyro_scale={error: [0.012, 0.008, -0.01]}",
      "effects.gyro_misalignment={xy: 0.007, xz: -0.006, yz: 0.007}",
      "effects.radial_distortion={k1: 0.03, k2: -0.02}"};
  const Calibrated plain = Check(device, DeviceClass::kPhone);
  const Calibrated usual = Check(device, DeviceClass::kPhone, "usual");
  EXPECT_TRUE(plain.doubt.has_value());
  EXPECT_FALSE(usual.doubt.has_value()) << *usual.doubt;
  EXPECT_THAT(usual.report.doubts, testing::IsEmpty());
  const Calibration& found = usual.report.calibration;
  const StateVector error = Difference(found, usual.simulated.truth);
  const StateVector error_plain = Difference(plain.report.calibration, plain.simulated.truth);
  EXPECT_LT(std::abs(error[kStateFocal]), 0.3 * std::abs(error_plain[kStateFocal]));
  const StateVector in_sigmas = error.cwiseQuotient(found.sigma());
  EXPECT_LT(in_sigmas.cwiseAbs().maxCoeff(), 3.5) << in_sigmas.transpose();
  ASSERT_TRUE(found.sigma_total().has_value());
  EXPECT_LT((*found.sigma_total())[kStateFocal], 1.001 * found.sigma()[kStateFocal]);
}

// No phone's gyro reads 8 % too much: a fit that says so stands for something else.
TEST(ModelCheck, DoubtsAnEffectThatIsLargerThanUsual) {
  const Calibrated c =
      Check({"effects.gyro_scale={error: [0.08, 0.08, -0.08]}"}, DeviceClass::kPhone, "usual");
  EXPECT_THAT(c.report.doubts, testing::Contains(testing::AllOf(HasSubstr("larger than usual"),
                                                                HasSubstr("gyro_scale ("))));
}

// Halves that disagree by little more than usual effects make of it: the factor that is left is
// nothing to doubt, and is not printed as 1.0.
TEST(ModelCheck, AFactorOfOneIsNoDoubt) {
  const Calibrated c = Check({"effects.clock_skew={ppm: 200}"}, DeviceClass::kPhone);
  ASSERT_GT(c.report.halves_chi2, kHalvesLimit);  // so the covariance was multiplied
  const StateCovariance of_noise = c.before / c.report.halves_chi2;
  const double noise = of_noise.trace();
  const auto with = [&](double chi2) {
    CalibrationReport apart = c.report;
    apart.halves_chi2 = chi2;
    apart.calibration.covariance = chi2 * of_noise;
    apart.doubts = {std::string(kHalvesDoubt) + " (by hand)"};
    apart.systematic.clear();
    apart.notes.clear();
    CheckModel(c.simulated.recording, {}, DeviceClass::kPhone, &apart);
    return apart;
  };
  // What is left of the covariance's factor says what is expected.
  const double expected = 1000.0 / (with(1000.0).calibration.covariance.trace() / noise);
  ASSERT_GT(1.08 * expected, kHalvesLimit);
  const CalibrationReport little = with(1.08 * expected);
  EXPECT_FALSE(SaysThatHalvesDisagree(little.doubts));
  EXPECT_TRUE(SaysThatHalvesDisagree(little.notes));
  EXPECT_NEAR(little.calibration.covariance.trace() / noise, 1.08, 1e-6);
  const CalibrationReport more = with(1.5 * expected);
  EXPECT_THAT(more.doubts, testing::Contains(HasSubstr("multiplied by 1.2")));
}

// The delay of these tablets jitters from second to second (docs/lab/measured.md): whatever one
// stretch says of it, the next one does not know, and still it is there.
TEST(ModelCheck, MeasuredDelaysThatJitterAreDoubted) {
  const auto folder = MeasuredData("tablet-attitude/D02");
  if (!folder) GTEST_SKIP() << "no measured recordings: set CAMGYRO_DATA";
  const auto recording = ReadRecording(*folder);
  ASSERT_TRUE(recording) << recording.error().message;
  auto report = CalibrateRecording(*recording, nullptr, {});
  ASSERT_TRUE(report) << report.error().message;
  const auto doubt = CheckModel(*recording, {}, DeviceClass::kPhone, &*report);
  ASSERT_TRUE(doubt);
  EXPECT_THAT(*doubt, HasSubstr("delay_wander"));
}

}  // namespace
}  // namespace camgyro
