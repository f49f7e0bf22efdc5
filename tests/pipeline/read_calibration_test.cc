// calibration.yaml and truth.yaml read back; what is wrong is refused with file, line and key.
#include "pipeline/read_calibration.h"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "estimator/calibrate.h"
#include "pipeline/result_files.h"
#include "tests/measured_data.h"
#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ReadCalibrationTest : public CamgyroTest {
 protected:
  Result<Calibration> Read(const std::string& text) const {
    std::ofstream(Path("c.yaml")) << text;
    return ReadCalibration(Path("c.yaml"));
  }
};

TEST_F(ReadCalibrationTest, WhatWasWrittenIsWhatIsRead) {
  CalibrationReport report;
  Calibration& c = report.calibration;
  c.width_px = 320;
  c.height_px = 240;
  c.distortion_model = DistortionModel::kRadTan;
  c.lens << 290.125, 161.5, 118.25, 1.0625, -0.25, 0.0625, 0.5e-3, -0.25e-3, 0.0, 0.0, 0.0, 0.0;
  c.readout_s = -0.0125;
  c.delay_s = 465.0625;
  c.bias_gyro_rad_s << 0.5, -0.25, 0.125;
  c.q_gyro_cam = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  for (int i = 0; i < kStateSize; ++i) {
    for (int j = 0; j < kStateSize; ++j) c.covariance(i, j) = (i == j ? 64.0 : 0.0) + i * j;
  }
  c.determined.fill(true);
  c.determined[kStateReadout] = c.determined[kStateRotation + 2] = false;
  const Result<Calibration> read = Read(CalibrationYaml(report, /*attitudes=*/false));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->width_px, 320);
  EXPECT_EQ(read->height_px, 240);
  EXPECT_EQ(read->distortion_model, DistortionModel::kRadTan);
  EXPECT_EQ(read->lens, c.lens);
  EXPECT_LT(Difference(*read, c).norm(), 1e-12);
  EXPECT_EQ(read->covariance, c.covariance);
  EXPECT_EQ(read->determined, c.determined);

  c.distortion_model = DistortionModel::kKannalaBrandt;
  c.lens.tail<8>() << 0.0, 0.0, 0.0, 0.0, 0.25, -0.125, 0.0625, 0.5e-3;
  const Result<Calibration> wide = Read(CalibrationYaml(report, /*attitudes=*/false));
  ASSERT_TRUE(wide) << wide.error().message;
  EXPECT_EQ(wide->distortion_model, DistortionModel::kKannalaBrandt);
  EXPECT_EQ(wide->lens, c.lens);

  const Result<Calibration> attitudes = Read(CalibrationYaml(report, /*attitudes=*/true));
  ASSERT_FALSE(attitudes);
  EXPECT_THAT(attitudes.error().message, HasSubstr("camera: focal_px: expected a finite number"));
}

// A fitted departure from the pinhole is written as the Kannala-Brandt lens nearest to it.
TEST_F(ReadCalibrationTest, FittedKannalaBrandtIsWrittenInItsOwnCoefficients) {
  CalibrationReport report;
  Calibration& c = report.calibration;
  c.width_px = 720;
  c.height_px = 480;
  c.lens = MakePinhole(400.0, {359.5, 239.5});
  EffectSetup setup;
  const Result<EffectSet> effects = MakeEffects("radial_distortion:kannala_brandt", setup);
  ASSERT_TRUE(effects) << effects.error().message;
  c.effects = std::make_shared<EffectSet>(*effects);
  c.effect_values = Eigen::Vector4d(-0.32, -0.14, 0.0, -0.08);
  c.effect_covariance = 1e-4 * Eigen::Matrix4d::Identity();
  const std::string yaml = CalibrationYaml(report, /*attitudes=*/false);
  EXPECT_THAT(yaml, HasSubstr("sigma: [0.01, 0.01, 0.01, 0.01]"));
  const Result<Calibration> read = Read(yaml);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->distortion_model, DistortionModel::kKannalaBrandt);
  for (const double u : {0.0, 200.0, 700.0}) {
    RayJet fitted, written;
    ASSERT_TRUE(GetLens(c.distortion_model).Unproject({u, 100.0}, c.FullLens(), &fitted));
    ASSERT_TRUE(GetLens(read->distortion_model).Unproject({u, 100.0}, read->lens, &written));
    EXPECT_LT((fitted.ray - written.ray).norm(), 1e-3) << u;
  }
}

// Recordings are combined from their files as from memory.
TEST_F(ReadCalibrationTest, AReportIsReadBackToBeCombined) {
  CalibrationReport report;
  Calibration& c = report.calibration;
  c.width_px = 320;
  c.height_px = 240;
  c.lens = MakePinhole(290.125, {161.5, 118.25});
  c.q_gyro_cam = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  c.covariance = 1e-4 * StateCovariance::Identity();
  c.total_covariance = 4e-4 * StateCovariance::Identity();
  c.determined.fill(true);
  StateVector d = StateVector::LinSpaced(0.01, 0.11);
  report.prior.mean = Moved(c, d);
  report.prior.sigma = StateVector::LinSpaced(1.0, 11.0);
  report.device_class = "phone";
  report.systematic = {{"gyro_scale", StateVector::LinSpaced(0.0, 1.0)}};
  report.quality = {100, 5000, 0.75, 0.5, 0.25, 2.5, 0.625};
  const std::string yaml = CalibrationYaml(report, /*attitudes=*/false);
  const auto read_report = [&](const std::string& text) {
    std::ofstream(Path("c.yaml")) << text;
    return ReadCalibrationReport(Path("c.yaml"));
  };
  const Result<CalibrationReport> read = read_report(yaml);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_LT(Difference(read->calibration, c).norm(), 1e-9);
  EXPECT_EQ(*read->calibration.total_covariance, *c.total_covariance);
  EXPECT_LT(Difference(read->prior.mean, report.prior.mean).norm(), 1e-9);
  EXPECT_LT((read->prior.sigma - report.prior.sigma).norm(), 1e-9);
  EXPECT_EQ(read->device_class, "phone");
  ASSERT_EQ(read->systematic.size(), 1u);
  EXPECT_EQ(read->systematic[0].effect, "gyro_scale");
  EXPECT_LT((read->systematic[0].sigma - report.systematic[0].sigma).norm(), 1e-9);
  EXPECT_EQ(read->quality.matches, 5000);
  EXPECT_EQ(read->quality.design_effect, 2.5);
  EXPECT_EQ(read->quality.rms_px, 0.625);

  const auto with = [&](const std::string& before, const std::string& after) {
    std::string text = yaml;
    text.replace(text.find(before), before.size(), after);
    const Result<CalibrationReport> other = read_report(text);
    return other ? std::string("was read") : other.error().message;
  };
  EXPECT_THAT(with("prior:", "other:"), HasSubstr("prior: offset: is missing; expected a"));
  EXPECT_THAT(with("sigma: [1, 2,", "sigma: [0, 2,"), HasSubstr("prior: sigma: expected numbers"));
  EXPECT_THAT(with("- [0.0001,", "- [-0.0001,"), HasSubstr("matrix: expected a covariance"));
  EXPECT_THAT(with("matches: 5000", "matches: 5e99"), HasSubstr("matches: expected a whole"));
  EXPECT_THAT(with("effects:\n  []", "effects: [aspect_ratio]"),
              HasSubstr("effects: aspect_ratio: expected a calibration without it"));
  // That of a recording is not the device's.
  EXPECT_EQ(with("effects:\n  []", "effects: [clock_skew]"), "was read");
  // It has a place in the covariance, as what a picture that is higher than wide may have.
  EXPECT_EQ(with("effects:\n  []", "effects: [readout_direction]"), "was read");
}

TEST_F(ReadCalibrationTest, SaysThatColumnsAreRead) {
  const auto read = [&](const std::string& readout, const std::string& columns) {
    std::ofstream(Path("c.yaml"))
        << "camera: {resolution: [48, 64], focal_px: 50}\nshutter: {readout_s: " << readout
        << "}\neffects: [{name: clock_skew, parameters: [{value: 9}]}, {name: readout_direction, "
        << "parameters: [{name: column_readout, value: " << columns << "}]}]\n";
    const Result<Calibration> rows = ReadCalibrationOfRows(Path("c.yaml"));
    return rows ? std::string("by rows") : rows.error().message;
  };
  EXPECT_EQ(read("0.02", "0.0029"), "by rows");
  EXPECT_EQ(read("0.0001", "-0.0002"), "by rows");  // a global shutter
  EXPECT_THAT(read("0.001", "-0.03"), HasSubstr("c.yaml: the pictures are read column by column"));
  EXPECT_THAT(read("0.02", "fast"), HasSubstr("c.yaml:3: effects: value: expected"));
}

TEST_F(ReadCalibrationTest, AbsentSectionsKeepDefaults) {
  const Result<Calibration> read = Read("camera: {resolution: [64, 48], focal_px: 50}\n");
  ASSERT_TRUE(read) << read.error().message;
  const LensParameters pinhole = MakePinhole(50.0, {31.5, 23.5});
  EXPECT_EQ(read->lens, pinhole);
  EXPECT_EQ(read->distortion_model, DistortionModel::kNone);
  EXPECT_EQ(read->readout_s, 0.0);
  EXPECT_EQ(read->delay_s, 0.0);
  EXPECT_EQ(read->q_gyro_cam.w(), 1.0);
  EXPECT_EQ(read->covariance, StateCovariance::Zero());
}

TEST_F(ReadCalibrationTest, TruthOfASimulation) {
  Simulate("duration_s: 0.2\ncamera: {focal_px: 300, delay_s: 0.0625}\n", "a");
  const Result<Calibration> read = ReadCalibration(Path("a/truth.yaml"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->lens[kFocal], 300.0);
  EXPECT_EQ(read->delay_s, 0.0625);
}

// The values that stand in the truth.yaml beside the recording.
TEST_F(ReadCalibrationTest, TruthOfAnotherSimulator) {
  const auto path = MeasuredData("ov_handheld_gs/truth.yaml");
  if (!path) GTEST_SKIP() << "no ov_handheld_gs in $CAMGYRO_DATA";
  const Result<Calibration> read = ReadCalibration(*path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->distortion_model, DistortionModel::kRadTan);
  EXPECT_THAT(std::vector<double>(read->lens.data(), read->lens.data() + kKb1),
              ElementsAre(457.296, 367.215, 248.375, 1.0029696, -0.28340811, 0.07395907, 0.00019359,
                          0.00001762));
  EXPECT_EQ(read->delay_s, 0.03);
}

// Parameters that Calibration does not hold may stand between those that it holds.
TEST_F(ReadCalibrationTest, CovarianceGoesByName) {
  const Result<Calibration> read = Read(
      "camera: {resolution: [64, 48], focal_px: 50}\n"
      "covariance: {order: [delay_s, gyro_scale_x, focal_px], matrix: [[4, 7, 2], [7, 9, 7], [2, "
      "7, 16]]}\n");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->covariance(kStateDelay, kStateDelay), 4.0);
  EXPECT_EQ(read->covariance(kStateDelay, kStateFocal), 2.0);
  EXPECT_EQ(read->covariance(kStateFocal, kStateFocal), 16.0);
  EXPECT_EQ(read->covariance.cwiseAbs().sum(), 4.0 + 16.0 + 2.0 * 2.0);
}

TEST_F(ReadCalibrationTest, RefusesWithFileLineAndKey) {
  const std::string camera = "camera:\n  resolution: [64, 48]\n  focal_px: {value: 50, sigma: 1}\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "c.yaml: expected the keys of a calibration.yaml"},
      {"shutter: {readout_s: 1}\n", "c.yaml: camera: resolution: is missing"},
      {"camera:\n  resolution: [64, 48]\n", "c.yaml:2: camera: focal_px: is missing"},
      {"camera: {resolution: [64], focal_px: 5}", "c.yaml:1: camera: resolution: expected a list"},
      {"camera: {resolution: [6.5, 4], focal_px: 5}", "resolution: expected [width, height]"},
      {"camera:\n  resolution: [64, 48]\n  focal_px: {value: -50}\n",
       "c.yaml:3: camera: focal_px: expected a number above zero"},
      {"camera: 7\n", "c.yaml:1: camera: expected a map"},
      {camera + "  distortion: {model: omni, value: [0, 0, 0, 0]}\n",
       "c.yaml:4: camera: distortion: model: `omni` is unknown, expected none, radtan or "
       "kannala_brandt"},
      {camera + "  distortion:\n    model: radtan\n    value: [0, 0, 0]\n",
       "c.yaml:6: camera: distortion: expected a list of 4 numbers, got 3"},
      {camera + "  distortion: {model: radtan}\n", "distortion: expected value: [k1, k2, p1, p2]"},
      {camera + "shutter:\n  readout_s: {value: fast}\n",
       "c.yaml:5: shutter: readout_s: expected a number"},
      {camera + "clock: {delay_s: {value: .inf}}\n", "clock: delay_s: expected a finite number"},
      {camera + "extrinsics: {q_gyro_cam_wxyz: [1, 1, 0, 0]}\n",
       "c.yaml:4: extrinsics: q_gyro_cam_wxyz: expected a quaternion of norm 1"},
      {camera + "covariance:\n  order: [focal_px]\n  matrix: [[1, 2]]\n",
       "c.yaml:6: covariance: matrix: expected a square matrix"},
      {camera + "quality: {unobservable: {a: 1}}\n", "quality: unobservable: expected a list"},
      {"camera: {resolution: [64, 48\n", "c.yaml:2: not valid YAML"},
  };
  for (const auto& [text, complaint] : cases) {
    const Result<Calibration> read = Read(text);
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(read.error().message, HasSubstr(complaint));
  }
  EXPECT_THAT(ReadCalibration(Path("nowhere.yaml")).error().message,
              HasSubstr("nowhere.yaml: cannot be opened"));
}

}  // namespace
}  // namespace camgyro
