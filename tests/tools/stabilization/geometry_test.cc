// Paths, warps and registration on simulated sensors; no pictures.
#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/so3.h"
#include "simulation/simulate.h"
#include "tools/stabilization/camera_path.h"
#include "tools/stabilization/frame_warp.h"
#include "tools/stabilization/registration.h"

namespace camgyro {
namespace {

// Turning only: what the gyro explains is all there is. 0.1 px of noise, a perfect gyro.
simulation::Simulated Turning(double noise_px) {
  simulation::Scenario scenario;
  scenario.seed = 3;
  scenario.duration_s = 4.0;
  scenario.motion.kind = simulation::MotionKind::kRotation;
  scenario.motion.speed_m_s = 0.0;
  scenario.motion.sway_rms_m_s = 0.0;
  scenario.tracks.noise_px = noise_px;
  scenario.gyro.noise_density_rad_s_rtHz = 0.0;
  scenario.gyro.accelerometer = false;
  return *simulation::SimulateTracks(scenario);
}

// A recording whose gyro turns about y with a rate given for each sample, at 200 Hz; frames at
// 50 Hz, from 0.5 s on.
Recording TurningAboutY(const std::function<double(double time_s)>& rate_rad_s) {
  Recording recording;
  for (int i = 0; i <= 1000; ++i) {
    recording.gyro.push_back({i * int64_t{5000000}, {0.0, rate_rad_s(0.005 * i), 0.0}});
  }
  for (int i = 0; i < 200; ++i) {
    Frame frame;
    frame.stamp_ns = 500000000 + i * int64_t{20000000};
    recording.frames.push_back(frame);
  }
  return recording;
}

Calibration Pinhole() {
  Calibration c;
  c.width_px = 640;
  c.height_px = 480;
  c.lens = MakePinhole(500.0, {325.0, 236.0}, 1.02);
  return c;
}

double AngleAboutY(const Eigen::Quaterniond& q) { return Log<double>(q).y(); }

TEST(CameraPath, IntegratesTheGyroLessItsBias) {
  Calibration c = Pinhole();
  c.bias_gyro_rad_s.y() = 0.1;
  c.delay_s = 0.25;
  c.readout_s = 0.02;
  const CameraPath path(TurningAboutY([](double) { return 0.6; }), c);
  EXPECT_DOUBLE_EQ(path.RowTime(0, 120.0), 0.5 + 0.25 + 0.02 * 0.25);
  const Eigen::Quaterniond q(path.R_world_cam(0, 120.0));
  EXPECT_NEAR(AngleAboutY(q), 0.5 * 0.755, 1e-9);
}

TEST(CameraPath, KnowsWhichFramesTheGyroCovers) {
  Calibration c = Pinhole();
  c.delay_s = -0.55;  // the first three frames are before the gyro's first sample
  c.readout_s = 0.015;
  const CameraPath path(TurningAboutY([](double) { return 0.0; }), c);
  EXPECT_EQ(path.first_frame(), 3);
  EXPECT_EQ(path.last_frame(), 199);
  c.delay_s = 100.0;
  const CameraPath beyond(TurningAboutY([](double) { return 0.0; }), c);
  EXPECT_GT(beyond.first_frame(), beyond.last_frame());
}

TEST(SmoothOrientations, KeepsASteadyTurnAndDampsShake) {
  constexpr double kShake = 0.05, kShakeHz = 2.0, kTurn = 0.8;  // rad, Hz, rad/s
  const Recording recording = TurningAboutY([&](double t) {
    return kTurn + kShake * 2.0 * M_PI * kShakeHz * std::cos(2.0 * M_PI * kShakeHz * t);
  });
  const CameraPath path(recording, Pinhole());
  for (const double smooth_s : {0.05, 0.1}) {
    const auto smooth = SmoothOrientations(path, 0.0, smooth_s);
    ASSERT_EQ(smooth.size(), 200u);
    // What a Gaussian leaves of a sine.
    const double left = kShake * std::exp(-0.5 * std::pow(2.0 * M_PI * kShakeHz * smooth_s, 2));
    for (size_t i = 30; i < 170; ++i) {
      const double t = 0.5 + 0.02 * static_cast<double>(i);
      EXPECT_NEAR(AngleAboutY(smooth[i]), kTurn * t + left * std::sin(2.0 * M_PI * kShakeHz * t),
                  2e-3)
          << i;
    }
  }
  const auto as_it_is = SmoothOrientations(path, 0.0, 0.0);
  EXPECT_LT(as_it_is[50].angularDistance(Eigen::Quaterniond(path.R_world_cam(50, 0.0))), 1e-12);
}

class FrameWarpTest : public testing::Test {
 protected:
  FrameWarpTest() {
    c_.distortion_model = DistortionModel::kRadTan;
    c_.lens[kK1] = -0.2;
    c_.lens[kK2] = 0.04;
    c_.delay_s = 0.013;
    c_.readout_s = 0.03;
    c_.q_gyro_cam = Eigen::Quaterniond(0.7, -0.1, 0.2, 0.6).normalized();
    Recording recording = TurningAboutY([](double t) { return 1.5 * std::cos(9.0 * t); });
    for (GyroSample& s : recording.gyro) {
      s.omega_gyro_rad_s.x() = std::sin(1e-9 * 7.0 * static_cast<double>(s.stamp_ns));
      s.omega_gyro_rad_s.z() = 0.7;
    }
    path_ = std::make_unique<CameraPath>(recording, c_);
  }
  FrameWarp Warp(double zoom) const {
    const Eigen::Quaterniond q(path_->R_world_cam(40, 200.0) *
                               Exp<double>({0.02, -0.03, 0.05}).toRotationMatrix());
    return FrameWarp(*path_, c_, 40, q, VirtualCamera(c_, 640, 480, zoom));
  }
  Calibration c_ = Pinhole();
  std::unique_ptr<CameraPath> path_;
};

TEST_F(FrameWarpTest, SourceAndVirtualAreInverse) {
  const FrameWarp warp = Warp(1.2);
  for (double u = 0.0; u < 640.0; u += 71.0) {
    for (double v = 0.0; v < 480.0; v += 53.0) {
      const auto px = warp.ToSource({u, v});
      ASSERT_TRUE(px);
      if (px->x() < 0.0 || px->x() > 640.0 || px->y() < 0.0 || px->y() > 480.0) continue;
      const auto back = warp.ToVirtual(*px);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - Eigen::Vector2d(u, v)).norm(), 0.01) << u << " " << v;
    }
  }
}

// The row's own rotation, written out.
TEST_F(FrameWarpTest, TurnsEachRowByItsOwnTime) {
  const FrameWarp warp = Warp(1.0);
  const VirtualCamera camera(c_, 640, 480, 1.0);
  const Eigen::Matrix3d R_world_virtual =
      path_->R_world_cam(40, 200.0) * Exp<double>({0.02, -0.03, 0.05}).toRotationMatrix();
  for (const double v : {3.0, 240.0, 470.0}) {
    RayJet jet;
    ASSERT_TRUE(
        GetLens(c_.distortion_model).Unproject({400.0, v}, c_.lens, &jet, LensDerivatives::kNone));
    const double time_s = 0.5 + 40 * 0.02 + c_.delay_s + c_.readout_s * v / 480.0;
    const auto expected =
        camera.Project(R_world_virtual.transpose() * path_->R_world_cam(time_s) * jet.ray);
    // The table of rotations is interpolated.
    EXPECT_LT((*warp.ToVirtual({400.0, v}) - *expected).norm(), 5e-3) << v;
  }
}

// A still camera without distortion, wherever its principal point is.
TEST(VirtualCamera, ZoomsAboutTheCentreOfThePicture) {
  Calibration c = Pinhole();
  c.lens[kCx] = 100.0;
  const CameraPath path(TurningAboutY([](double) { return 0.0; }), c);
  const Eigen::Quaterniond own(path.R_world_cam(3, 0.0));
  const FrameWarp same(path, c, 3, own, VirtualCamera(c, 640, 480, 1.0));
  EXPECT_LT((*same.ToSource({30.0, 400.0}) - Eigen::Vector2d(30.0, 400.0)).norm(), 1e-9);
  const FrameWarp twice(path, c, 3, own, VirtualCamera(c, 640, 480, 2.0));
  EXPECT_LT((*twice.ToSource({319.5, 239.5}) - Eigen::Vector2d(319.5, 239.5)).norm(), 1e-9);
  EXPECT_LT((*twice.ToSource({419.5, 239.5}) - Eigen::Vector2d(369.5, 239.5)).norm(), 1e-9);
}

TEST_F(FrameWarpTest, MapsAreTheWarp) {
  const FrameWarp warp = Warp(1.1);
  cv::Mat x, y;
  warp.Maps(&x, &y);
  ASSERT_EQ(x.size(), cv::Size(640, 480));
  for (int v = 5; v < 480; v += 37) {
    for (int u = 3; u < 640; u += 41) {
      const auto px = warp.ToSource({u, v});
      ASSERT_TRUE(px);
      // Between nodes of the mesh, distortion bends by less than this.
      EXPECT_NEAR(x.at<float>(v, u), px->x(), 0.05);
      EXPECT_NEAR(y.at<float>(v, u), px->y(), 0.05);
    }
  }
}

// What is left of a pure turn is the noise of two points: the median length of a two-dimensional
// Gaussian of sqrt(2) * 0.1 px is 1.177 of that.
TEST(Registration, LeavesNoiseWithTheTruthAndMoreWithout) {
  const simulation::Simulated s = Turning(/*noise_px=*/0.1);
  const std::vector<FramePair> pairs = PairsFromTracks(s.recording.tracks, 1);
  const RegistrationError recorded = RegisterAsRecorded(pairs);
  EXPECT_GT(recorded.turned_px, 5.0);
  const auto with = [&](double delay_s, double readout_s) {
    Calibration c = s.truth;
    c.delay_s = delay_s;
    c.readout_s = readout_s;
    return *RegisterRectified(s.recording, c, pairs);
  };
  const RegistrationError truth = with(s.truth.delay_s, s.truth.readout_s);
  EXPECT_NEAR(truth.turned_px, 1.177 * std::sqrt(2.0) * 0.1, 0.02);
  EXPECT_LT(truth.homography_px, recorded.homography_px);
  const double readout_only = with(s.truth.delay_s, 0.0).turned_px;
  const double late = with(s.truth.delay_s + 0.01, s.truth.readout_s).turned_px;
  const double later = with(s.truth.delay_s + 0.02, s.truth.readout_s).turned_px;
  EXPECT_GT(readout_only, 3.0 * truth.turned_px);
  EXPECT_GT(late, 3.0 * truth.turned_px);
  EXPECT_GT(later, 1.5 * late);
  EXPECT_FALSE(RegisterRectified(
      s.recording,
      [&] {
        Calibration c = s.truth;
        c.delay_s = 1e4;
        return c;
      }(),
      pairs));
}

}  // namespace
}  // namespace camgyro
