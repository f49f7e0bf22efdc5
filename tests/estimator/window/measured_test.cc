// The whole job on measured recordings, against what is known of the devices independently (the
// recordings' README files). $CAMGYRO_DATA; skipped, loudly, without.
#include <gmock/gmock.h>

#include "core/so3.h"
#include "estimator/calibrate.h"
#include "estimator/start/focal_scan.h"
#include "frontend/readers/read_recording.h"
#include "frontend/track_recording.h"
#include "tests/measured_data.h"
#include "tests/rotations_of_pictures.h"

namespace camgyro {
namespace {

// Defines `recording`.
#define READ_OR_SKIP(name)                                                    \
  const std::optional<std::string> path = MeasuredData(name);                 \
  if (!path) GTEST_SKIP() << "*** SKIPPED: no measured recording " << (name); \
  Result<Recording> read = ReadRecording(*path);                              \
  ASSERT_TRUE(read.has_value()) << read.error().message;                      \
  Recording& recording = *read

Result<CalibrationReport> Calibrate(Recording* recording) {
  if (recording->HasImages()) {
    const auto tracked = TrackRecording({}, nullptr, nullptr, recording);
    if (!tracked) return tl::unexpected(tracked.error());
  }
  return CalibrateRecording(*recording, RotationsOfPictures(*recording, 400), CalibrateOptions());
}

double AngleDeg(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return Log(Eigen::Quaterniond(a.conjugate() * b)).norm() * 180.0 / M_PI;
}

TEST(Measured, PhoneBehindAWindscreen) {
  READ_OR_SKIP("phone-cc9-street");
  const auto report = Calibrate(&recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  EXPECT_NEAR(c.lens[kFocal], 575.04, 0.04 * 575.04);  // published
  EXPECT_GT(c.delay_s, -3e-3);                         // half the exposure, 2.6 ms, before the row
  EXPECT_LT(c.delay_s, -2e-3);
  EXPECT_GT(c.readout_s, 30e-3);
  EXPECT_LT(c.readout_s, 33e-3);
}

// Cards on a table, hardly any pan or tilt: the halves of the recording contradict each other. The
// picture is higher than wide, and its columns are read, from right to left.
TEST(Measured, CardsOnATable) {
  READ_OR_SKIP("iphone-cards");
  const auto report = Calibrate(&recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  EXPECT_LT(std::abs(c.lens[kFocal] - 567.3), 3.0 * c.sigma()[kStateFocal]);  // checkerboard
  ASSERT_TRUE(c.effects && c.effects->Has("readout_direction"));
  EXPECT_NEAR(c.effect_values[0], -0.030, 0.010);  // what phones' sensors take
  EXPECT_LT(c.effect_covariance(0, 0), std::pow(5e-3, 2));
  EXPECT_LT(std::abs(c.readout_s), 3.0 * c.sigma()[kStateReadout]);
  EXPECT_TRUE(c.determined[kStateDelay] && c.determined[kStateFocal]);
  EXPECT_FALSE(report->doubts.empty());
}

TEST(Measured, TabletsByTheirAttitudes) {
  Eigen::Matrix3d axis_map;  // Android's
  axis_map << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  for (const char* name :
       {"D01", "D02", "D03", "D04", "D05", "D06", "D07", "D08", "D10", "D11", "D12", "D13"}) {
    SCOPED_TRACE(name);
    READ_OR_SKIP(std::string("tablet-attitude/") + name);
    const auto report = Calibrate(&recording);
    ASSERT_TRUE(report.has_value()) << report.error().message;
    EXPECT_LT(AngleDeg(report->calibration.q_gyro_cam, Eigen::Quaterniond(axis_map)), 4.0);
    EXPECT_TRUE(report->calibration.determined[kStateDelay]);
    EXPECT_TRUE(report->calibration.determined[kStateBias]);
  }
}

TEST(Measured, DroneWithItsLensGiven) {
  READ_OR_SKIP("euroc-v101-flight");
  recording.camera.aspect_ratio = 458.654 / 457.296;
  recording.camera.distortion_model = DistortionModel::kRadTan;
  recording.camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  const auto report = Calibrate(&recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  EXPECT_NEAR(c.lens[kFocal], 457.296, 0.03 * 457.296);
  EXPECT_LT(std::abs(c.readout_s), 3.0 * c.sigma()[kStateReadout]);  // global shutter
  EXPECT_LT(std::abs(c.delay_s), 2e-3);                              // hardware-synchronised
}

// A lens that nothing declares, and stamps in whole ms: pan and tilt fitted the gyro best at 305
// px, in an orientation that the motion did not determine at all, and every fit that came to 460 px
// was refused because of it.
TEST(Measured, StartThatSeesNoAxesTellsNoFocalLength) {
  READ_OR_SKIP("euroc-v101-flight");
  const auto whole_ms = [](int64_t ns) { return (ns + 500000) / 1000000 * 1000000; };
  for (Frame& frame : recording.frames) frame.stamp_ns = whole_ms(frame.stamp_ns);
  for (GyroSample& sample : recording.gyro) sample.stamp_ns = whole_ms(sample.stamp_ns);
  const auto tracked = TrackRecording({}, nullptr, nullptr, &recording);
  ASSERT_TRUE(tracked.has_value()) << tracked.error().message;
  const auto start =
      FindStartFromPictures(recording, RotationsOfPictures(recording, 400), StartOptions());
  ASSERT_TRUE(start.has_value()) << start.error().message;
  ASSERT_TRUE(start->focal.has_value());
  if (start->focal->determined) {
    EXPECT_NEAR(start->focal->value_px, 458.4, 4.0 * start->focal->sigma_px);
  }
}

TEST(Measured, DroneAtRestIsRefused) {
  READ_OR_SKIP("euroc-v101-rest");
  Result<CalibrationReport> report = Calibrate(&recording);
  const Status motion = CheckImageMotion(recording);
  EXPECT_TRUE(!report || !motion);
  if (!motion) {
    EXPECT_THAT(motion.error().message, ::testing::HasSubstr("no motion"));
  }
}

TEST(Measured, StabilisedVideoIsRefused) {
  READ_OR_SKIP("gopro-hero7-hypersmooth/hero7.mp4");
  const auto report = Calibrate(&recording);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().kind, ErrorKind::kCannotEstimate);
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("stabilised"));
}

// A gimbal: almost no rotation but in the last second.
TEST(Measured, GimbalGivesTheDelay) {
  READ_OR_SKIP("gopro-hero5-karma/karma.mp4");
  const auto report = Calibrate(&recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_GT(report->start.delay_middle_row_s, -25e-3);  // -10 to -20 ms in the README
  EXPECT_LT(report->start.delay_middle_row_s, -8e-3);
  const Calibration& c = report->calibration;
  if (c.determined[kStateFocal]) {
    // Profiles of this camera's fields of view: 390, 463 and 552 px; which it was, nobody knows.
    EXPECT_GT(c.lens[kFocal], 390.0 - 3.0 * c.sigma()[kStateFocal]);
    EXPECT_LT(c.lens[kFocal], 552.0 + 3.0 * c.sigma()[kStateFocal]);
  }
  if (c.determined[kStateReadout]) {  // not published; less than a frame, as of any camera
    EXPECT_GT(c.readout_s, -3.0 * c.sigma()[kStateReadout]);
    EXPECT_LT(c.readout_s, 1.0 / 29.97);
  }
  EXPECT_FALSE(report->doubts.empty());
}

// Simulated by a program that is not ours; the lens is given but for f, 3 % off, and c.
TEST(Measured, HandheldRollingShutter) {
  READ_OR_SKIP("ov_handheld_rs");
  recording.camera.aspect_ratio = 458.654 / 457.296;
  recording.camera.distortion_model = DistortionModel::kRadTan;
  recording.camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 0.00001762};
  const auto report = Calibrate(&recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  EXPECT_NEAR(c.delay_s, 0.030, 0.15e-3);
  EXPECT_NEAR(c.readout_s, 0.025, 0.3e-3);
  EXPECT_NEAR(c.lens[kFocal], 457.296, 0.0015 * 457.296);
  const Eigen::Quaterniond truth(0.712301461, -0.00770718, 0.010499323, 0.7017528);
  RecordProperty("rotation_error_deg", std::to_string(AngleDeg(c.q_gyro_cam, truth.normalized())));
  EXPECT_LT(AngleDeg(c.q_gyro_cam, truth.normalized()), 0.12);
}

}  // namespace
}  // namespace camgyro
