#include "estimator/start/focal_scan.h"

#include <gmock/gmock.h>

#include "simulated_rotation.h"

namespace camgyro {
namespace {

using ::testing::HasSubstr;

constexpr double kTrueFocalPx = 500.0;

// Rotations as pictures give them at a wrong focal length, to first order: image motion is focal
// length times pan and tilt, and the roll angle itself.
CameraRotationsAtFocals SeenAt(const Simulated& s) {
  return [&s](const std::vector<double>& focals_px) {
    std::vector<std::vector<CameraRotation>> seen(focals_px.size(), s.rotations);
    for (size_t k = 0; k < seen.size(); ++k) {
      for (CameraRotation& rotation : seen[k]) {
        Eigen::Vector3d angle = Log(rotation.q_a_b);
        angle.head<2>() *= kTrueFocalPx / focals_px[k];
        rotation.q_a_b = Exp(angle);
      }
    }
    return seen;
  };
}

SimulatedTruth CoarseTruth() {
  SimulatedTruth truth;
  truth.delay_s = -0.37;
  truth.q_gyro_cam = Exp(Eigen::Vector3d(0.03, -0.02, 1.6));
  truth.camera_noise_rad = 0.0015;
  truth.gyro_noise_rad_s = 0.003;
  return truth;
}

Simulated MakeScene(const RateFunction& rate, int seed) {
  Simulated s = Simulate(rate, CoarseTruth(), seed);
  s.recording.camera.width_px = 640;
  s.recording.camera.height_px = 480;
  return s;
}

TEST(FindStartAndFocal, FindsTheFocalLength) {
  double chi_square = 0.0;
  constexpr int kRuns = 10;
  for (int seed = 0; seed < kRuns; ++seed) {
    SCOPED_TRACE(seed);
    const Simulated s = MakeScene(SmoothRandomRate(70 + seed, 0.8), seed);
    const auto start = FindStartAndFocal(s.recording, SeenAt(s), {}, {});
    ASSERT_TRUE(start) << start.error().message;
    ASSERT_TRUE(start->focal);
    EXPECT_TRUE(start->focal->determined);
    EXPECT_NEAR(start->focal->value_px, kTrueFocalPx, 0.02 * kTrueFocalPx);
    EXPECT_LT(start->focal->sigma_px, 0.025 * kTrueFocalPx);
    EXPECT_LT(start->focal->runner_up_ratio, 0.7);
    EXPECT_NEAR(start->delay_middle_row_s, CoarseTruth().delay_s, 0.003);
    EXPECT_EQ(start->focal->curve.size(), 24u);
    chi_square +=
        std::pow((start->focal->value_px - kTrueFocalPx) / start->focal->sigma_px, 2) / kRuns;
  }
  // 10 values: sigma 0.45 about 1.
  EXPECT_LT(chi_square, 2.3);
}

TEST(FindStartAndFocal, AGuessThatIsFarOffDoesNotMatter) {
  Simulated s = MakeScene(SmoothRandomRate(70, 0.8), 0);
  s.recording.camera.focal_px = 0.5 * kTrueFocalPx;
  const auto start = FindStartAndFocal(s.recording, SeenAt(s), {}, {});
  ASSERT_TRUE(start) << start.error().message;
  EXPECT_NEAR(start->focal->value_px, kTrueFocalPx, 0.03 * kTrueFocalPx);
}

TEST(FindStartAndFocal, RollDoesNotTell) {
  const RateFunction smooth = SmoothRandomRate(80, 1.2);
  const Eigen::Quaterniond q_gyro_cam = CoarseTruth().q_gyro_cam;
  Simulated s = MakeScene(
      [&](double t) -> Eigen::Vector3d {
        return q_gyro_cam * Eigen::Vector3d(0, 0, smooth(t).x());
      },
      1);
  s.recording.camera.focal_px = 450.0;
  const auto start = FindStartAndFocal(s.recording, SeenAt(s), {}, {});
  ASSERT_TRUE(start) << start.error().message;
  EXPECT_FALSE(start->focal->determined);
  EXPECT_NEAR(start->focal->value_px, 450.0, 1e-9);
  EXPECT_THAT(start->notes, ::testing::Contains(HasSubstr("the focal length is not determined")));
}

TEST(FindStartAndFocal, RefusesWithTheReasonOfTheStart) {
  Simulated s = MakeScene([](double) { return Eigen::Vector3d(0.1, 0.0, 0.0); }, 1);
  auto start = FindStartAndFocal(s.recording, SeenAt(s), {}, {});
  ASSERT_FALSE(start);
  EXPECT_THAT(start.error().message, HasSubstr("no rotation in the recording"));
  s.recording.camera.width_px = s.recording.camera.height_px = 0;
  start = FindStartAndFocal(s.recording, SeenAt(s), {}, {});
  ASSERT_FALSE(start);
  EXPECT_EQ(start.error().kind, ErrorKind::kBadInput);
}

}  // namespace
}  // namespace camgyro
