#include "estimator/start/focal_scan.h"

#include <gmock/gmock.h>

#include "simulated_rotation.h"

namespace camgyro {
namespace {

using ::testing::HasSubstr;

constexpr double kTrueFocalPx = 500.0;

// Rotations as pictures give them at a wrong focal length, to first order: image motion is focal
// length times pan and tilt, and the roll angle itself.
CameraRotationsAt SeenAt(const Simulated& s) {
  return [&s](const Recording&, const std::vector<RotationTrial>& trials) {
    std::vector<std::vector<CameraRotation>> seen(trials.size(), s.rotations);
    for (size_t k = 0; k < seen.size(); ++k) {
      for (CameraRotation& rotation : seen[k]) {
        Eigen::Vector3d angle = Log(rotation.q_a_b);
        angle.head<2>() *= kTrueFocalPx / trials[k].focal_px;
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

Simulated MakeScene(const RateFunction& rate, int seed,
                    const SimulatedTruth& truth = CoarseTruth()) {
  Simulated s = Simulate(rate, truth, seed);
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
    ASSERT_TRUE(start->readout);
    EXPECT_FALSE(start->readout->determined);  // these rotations do not depend on it
    chi_square +=
        std::pow((start->focal->value_px - kTrueFocalPx) / start->focal->sigma_px, 2) / kRuns;
  }
  // 10 values: sigma 0.45 about 1.
  EXPECT_LT(chi_square, 2.3);
}

// Two and a half times the longer side, beyond the end of the scan: it goes on.
TEST(FindStartAndFocal, FindsATeleLens) {
  Simulated s = MakeScene(SmoothRandomRate(70, 0.8), 0);
  s.recording.camera.width_px = 200;
  s.recording.camera.height_px = 150;
  const auto start = FindStartAndFocal(s.recording, SeenAt(s), {}, {});
  ASSERT_TRUE(start) << start.error().message;
  ASSERT_TRUE(start->focal);
  EXPECT_TRUE(start->focal->determined);
  EXPECT_NEAR(start->focal->value_px, kTrueFocalPx, 0.02 * kTrueFocalPx);
  EXPECT_NEAR(start->delay_middle_row_s, CoarseTruth().delay_s, 0.003);
  // As far as it gets better, and not to the longest.
  EXPECT_LT(start->focal->curve.back().focal_px, 1.3 * kTrueFocalPx);
  FocalScanOptions no_further;
  no_further.longest_focal = no_further.max_focal;
  const auto without = FindStartAndFocal(s.recording, SeenAt(s), {}, no_further);
  EXPECT_FALSE(without && without->focal && without->focal->determined);
}

// What is wrong about the readout time, times the difference of the rates at the ends of a pair, is
// left between its matches: some of it, beside their noise.
TEST(FindStartAndFocal, FindsTheReadoutTime) {
  const RateFunction rate = SmoothRandomRate(70, 0.8);
  for (const double readout_s : {-0.02, 0.0, 0.013, 0.031}) {
    SCOPED_TRACE(readout_s);
    Simulated s = MakeScene(rate, 0);
    const CameraRotationsAt plain = SeenAt(s);
    const auto rolling = [&](const Recording& recording, const std::vector<RotationTrial>& trials) {
      auto seen = plain(recording, trials);
      for (size_t k = 0; k < seen.size(); ++k) {
        const double wrong_s = (trials[k].rough ? trials[k].rough->readout_s : 0.0) - readout_s;
        for (CameraRotation& rotation : seen[k]) {
          const auto rate_at = [&](int frame) {
            const int64_t stamp_ns = recording.frames[static_cast<size_t>(frame)].stamp_ns;
            return rate(1e-9 * static_cast<double>(stamp_ns) + CoarseTruth().delay_s);
          };
          const Eigen::Vector3d change = rate_at(rotation.frame_b) - rate_at(rotation.frame_a);
          rotation.residual_px = std::hypot(0.3, 0.2 * kTrueFocalPx * wrong_s * change.norm());
        }
      }
      return seen;
    };
    const auto start = FindStartAndFocal(s.recording, rolling, {}, {});
    ASSERT_TRUE(start) << start.error().message;
    ASSERT_TRUE(start->readout);
    EXPECT_TRUE(start->readout->determined);
    EXPECT_NEAR(start->readout->value_s, readout_s, 3.0 * start->readout->sigma_s);
    EXPECT_LT(start->readout->sigma_s, 0.003);

    s.recording.camera.readout_s = readout_s;
    const auto declared = FindStartAndFocal(s.recording, rolling, {}, {});
    ASSERT_TRUE(declared) << declared.error().message;
    EXPECT_EQ(declared->readout->value_s, readout_s);
    EXPECT_EQ(declared->readout->sigma_s, 0.0);
  }
}

// Of a camera that steps sideways all the time, past points of one distance, rotations may take the
// step for a turn. What the gyro lacks of it then is its bias; and rotations that are made near the
// gyro's with that bias are as wrong, at matches that fit each other worse.
TEST(FindStartAndFocal, StepsTakenForATurnAreNoBias) {
  SimulatedTruth truth = CoarseTruth();
  truth.bias_gyro_rad_s = {0.01, -0.02, 0.015};
  const Eigen::Vector3d with_step = truth.bias_gyro_rad_s + Eigen::Vector3d(0.0, 0.25, 0.0);
  const Simulated s = MakeScene(SmoothRandomRate(70, 0.8), 0, truth);
  const CameraRotationsAt plain = SeenAt(s);
  const auto stepping = [&](const Recording& recording, const std::vector<RotationTrial>& trials) {
    auto seen = plain(recording, trials);
    for (size_t k = 0; k < seen.size(); ++k) {
      const Eigen::Vector3d bias = trials[k].rough ? trials[k].rough->bias_gyro_rad_s : with_step;
      const Eigen::Vector3d wrong = truth.bias_gyro_rad_s - bias;
      const bool astray = wrong.norm() > 0.1;  // else near enough for the right minimum
      for (CameraRotation& rotation : seen[k]) {
        rotation.residual_px = astray ? 1.0 : 0.3;
        if (!astray) continue;
        const Eigen::Vector3d turn = truth.q_gyro_cam.conjugate() * wrong / truth.fps;
        rotation.q_a_b = rotation.q_a_b * Exp(turn);
      }
    }
    return seen;
  };
  const auto start = FindStartAndFocal(s.recording, stepping, {}, {});
  ASSERT_TRUE(start) << start.error().message;
  EXPECT_LT((start->bias_gyro_rad_s - truth.bias_gyro_rad_s).norm(), 0.01)
      << start->bias_gyro_rad_s.transpose();
  EXPECT_NEAR(start->focal->value_px, kTrueFocalPx, 0.03 * kTrueFocalPx);
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
