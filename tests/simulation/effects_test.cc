// Each effect of the catalogue against a formula written here; those of the rate: gyro_test.cc.
#include <gmock/gmock.h>

#include <Eigen/SVD>
#include <cmath>

#include "core/so3.h"
#include "core/time.h"
#include "simulation/simulate.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTrueFocalPx = 650.0, kTrueCx = 359.5, kTrueCy = 239.5, kWidthPx = 720.0,
                 kHeightPx = 480.0;
constexpr double kTrueDelayS = 0.015, kTrueReadoutS = 0.02;  // the defaults of a scenario

Scenario NoiselessTracks() {
  Scenario scenario;
  scenario.duration_s = 2.0;
  scenario.tracks.noise_px = 0.0;
  return scenario;
}

// What the two halves of the measurement are for one observation; a test replaces one of them.
struct Reference {
  // Time on the gyro clock from the frame's stamp (s after the first gyro stamp) and exposure.
  std::function<double(double stamp_s, double exposure_s, const Vector2d& px)> time =
      [](double stamp_s, double, const Vector2d& px) {
        return stamp_s + kTrueDelayS + kTrueReadoutS * px.y() / kHeightPx;
      };
  std::function<Vector2d(const Vector3d& p, double t)> project = [](const Vector3d& p, double) {
    return Vector2d(kTrueFocalPx * p.x() / p.z() + kTrueCx, kTrueFocalPx * p.y() / p.z() + kTrueCy);
  };
};

void ExpectTracksFollow(const Reference& reference, const Scenario& scenario,
                        double tolerance_px = 1e-6) {
  const Simulated s = SimulateTracks(scenario).value();
  double largest = 0.0, difference = 0.0;
  const Reference plain;
  for (size_t i = 0; i < s.points.size(); ++i) {
    const Frame& frame = s.recording.frames[i];
    const double stamp_s = SecondsSince(s.recording.gyro.front().stamp_ns, frame.stamp_ns);
    for (size_t k = 0; k < s.points[i].size(); ++k) {
      const Vector2d px = s.recording.tracks[i][k].px;
      const auto predict = [&](const Reference& r) {
        const double t = r.time(stamp_s, frame.exposure_s, px);
        const CameraState camera = s.camera->trajectory().At(t);
        const Vector3d world = s.points[i][k].world_m - camera.p_world_m;
        return r.project(camera.R_world_cam.transpose() * world, t);
      };
      largest = std::max(largest, (predict(reference) - px).norm());
      difference = std::max(difference, (predict(plain) - px).norm());
    }
  }
  EXPECT_LT(largest, tolerance_px);
  EXPECT_GT(difference, 0.3) << "the effect does not show";
}

TEST(LensEffects, RadialAndTangentialDistortion) {
  Scenario scenario = NoiselessTracks();
  scenario.effects.radial_distortion.k1 = -0.2;
  scenario.effects.radial_distortion.k2 = 0.05;
  scenario.effects.tangential_distortion = {0.002, -0.001};
  Reference reference;
  reference.project = [](const Vector3d& p, double) {
    const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
    const double radial = 1.0 - 0.2 * r2 + 0.05 * r2 * r2;
    return Vector2d(
        kTrueFocalPx * (x * radial + 2 * 0.002 * x * y - 0.001 * (r2 + 2 * x * x)) + kTrueCx,
        kTrueFocalPx * (y * radial + 0.002 * (r2 + 2 * y * y) - 2 * 0.001 * x * y) + kTrueCy);
  };
  ExpectTracksFollow(reference, scenario);
}

TEST(LensEffects, KannalaBrandt) {
  Scenario scenario = NoiselessTracks();
  scenario.camera.focal_px = 300.0;
  scenario.effects.radial_distortion = {-0.02, 0.004, -0.001, 0.0002, true};
  Reference reference;
  reference.project = [](const Vector3d& p, double) {
    const double radius = std::hypot(p.x(), p.y()), a = std::atan2(radius, p.z());
    const double bent = a - 0.02 * std::pow(a, 3) + 0.004 * std::pow(a, 5) -
                        0.001 * std::pow(a, 7) + 0.0002 * std::pow(a, 9);
    return Vector2d(300.0 * bent * p.x() / radius + kTrueCx,
                    300.0 * bent * p.y() / radius + kTrueCy);
  };
  ExpectTracksFollow(reference, scenario);
}

TEST(LensEffects, AspectRatioAndFocalDrift) {
  Scenario scenario = NoiselessTracks();
  scenario.effects.aspect_ratio.ratio = 1.012;
  scenario.effects.focal_drift = {1.5, 2.0, 3.0};
  Reference reference;
  reference.project = [](const Vector3d& p, double t) {
    const double f = kTrueFocalPx + 1.5 * t + 2.0 * std::sin(2.0 * M_PI * t / 3.0);
    return Vector2d(1.012 * f * p.x() / p.z() + kTrueCx, f * p.y() / p.z() + kTrueCy);
  };
  ExpectTracksFollow(reference, scenario);
}

// The angle that the stabiliser takes out obeys angle' = omega - 2 pi corner angle; a slow Euler
// integration of it with Richardson's extrapolation is good to 1e-6 rad here.
TEST(LensEffects, OpticalStabilisationMovesThePictureAgainstTheRotation) {
  Scenario scenario = NoiselessTracks();
  scenario.effects.optical_stabilisation = {0.4, 0.5};
  const Simulated s = SimulateTracks(scenario).value();
  const auto integrate = [&](double step, double until) {
    Vector2d angle = Vector2d::Zero();
    const int count = static_cast<int>(std::lround((until + 1.0) / step));
    for (int i = 0; i < count; ++i) {
      const Vector3d omega = s.camera->trajectory().At(-1.0 + (i + 0.5) * step).omega_cam_rad_s;
      angle += step * (omega.head<2>() - 2.0 * M_PI * 0.5 * angle);
    }
    return angle;
  };
  double largest = 0.0;
  for (const double t : {0.8, 1.3, 2.2}) {
    const Vector2d angle = 2.0 * integrate(2.5e-4, t) - integrate(5e-4, t);
    const Vector2d shift = s.camera->StabiliserShift(t);
    EXPECT_NEAR(shift.x(), 0.4 * kTrueFocalPx * angle.y(), 1e-3);
    EXPECT_NEAR(shift.y(), -0.4 * kTrueFocalPx * angle.x(), 1e-3);
    largest = std::max(largest, shift.norm());
  }
  EXPECT_GT(largest, 5.0);
  // And the sign is that of a stabiliser: features move less than without.
  const auto motion = [](const Simulated& simulated) {
    double sum = 0.0, count = 0.0;
    for (const FramePair& pair : PairsFromTracks(simulated.recording.tracks, 1)) {
      for (const Match& match : pair.matches) {
        sum += (match.px_b - match.px_a).norm();
        count += 1.0;
      }
    }
    return sum / count;
  };
  scenario.motion = MotionPreset(MotionKind::kRotation);
  const double stabilised = motion(SimulateTracks(scenario).value());
  scenario.effects.optical_stabilisation.gain = 0.0;
  EXPECT_LT(stabilised, 0.8 * motion(SimulateTracks(scenario).value()));
}

// The lens goes no further than its stop, in any direction, and leaves it when the camera turns
// back.
TEST(LensEffects, OpticalStabilisationHasStops) {
  constexpr double kTravelRad = 0.04, kStep = 1e-4;
  Scenario scenario = NoiselessTracks();
  scenario.effects.optical_stabilisation = {0.9, 0.5, kTravelRad};
  const Simulated s = SimulateSensors(scenario).value();
  Vector2d angle = Vector2d::Zero();
  int at_stop = 0, moves = 0;
  for (int i = 0; i < 45000; ++i) {
    const double t = -1.0 + i * kStep;
    if (i % 250 == 0 && t > 0.0) {
      const Vector2d shift = s.camera->StabiliserShift(t) / (0.9 * kTrueFocalPx);
      EXPECT_NEAR((shift - Vector2d(angle.y(), -angle.x())).norm(), 0.0, 2e-4) << t;
      (shift.norm() > 0.99 * kTravelRad ? at_stop : moves)++;
    }
    const Vector3d omega = s.camera->trajectory().At(t + 0.5 * kStep).omega_cam_rad_s;
    angle += kStep * (omega.head<2>() - 2.0 * M_PI * 0.5 * angle);
    if (angle.norm() > kTravelRad) angle *= kTravelRad / angle.norm();
  }
  EXPECT_GT(at_stop, 10);
  EXPECT_GT(moves, 10);
}

TEST(ClockEffects, SkewStepWanderAndExposure) {
  Scenario scenario = NoiselessTracks();
  scenario.camera.exposure_swing = 0.5;
  scenario.effects.clock_skew.ppm = 800.0;
  scenario.effects.delay_step = {1.5, 0.009};
  scenario.effects.exposure_delay.factor = 0.5;
  Reference reference;
  reference.time = [](double stamp_s, double exposure_s, const Vector2d& px) {
    const double t = stamp_s + kTrueDelayS;
    return t + 8e-4 * t + (t >= 1.5 ? 0.009 : 0.0) + 0.5 * exposure_s +
           kTrueReadoutS * px.y() / kHeightPx;
  };
  ExpectTracksFollow(reference, scenario);

  scenario = NoiselessTracks();
  scenario.duration_s = 30.0;
  scenario.effects.delay_wander = {0.004, 7.0};
  const Simulated s = SimulateSensors(scenario).value();
  double lowest = 1.0, highest = -1.0, step = 0.0;
  for (size_t i = 1; i < s.frames.size(); ++i) {
    lowest = std::min(lowest, s.frames[i].delay_s);
    highest = std::max(highest, s.frames[i].delay_s);
    step = std::max(step, std::abs(s.frames[i].delay_s - s.frames[i - 1].delay_s));
  }
  EXPECT_NEAR(lowest, kTrueDelayS - 0.004, 0.001);
  EXPECT_NEAR(highest, kTrueDelayS + 0.004, 0.001);
  EXPECT_LT(step, 0.004 * 2.0 * M_PI / 7.0 * 1.2 / 30.0);  // it wanders, it does not jump
}

// The part of the stamps' errors that neighbours share has its size, and is correlated for as long
// as was asked.
TEST(ClockEffects, StampsWander) {
  Scenario scenario;
  scenario.duration_s = 600.0;
  scenario.camera.rate_hz = 10.0;
  scenario.effects.frame_stamp_jitter.wander_s = 3e-3;
  scenario.effects.frame_stamp_jitter.wander_time_s = 1.5;
  const Simulated s = SimulateSensors(scenario).value();
  constexpr size_t kApart = 15;  // frames: 1.5 s
  double squares = 0.0, products = 0.0;
  const auto error = [&](size_t i) { return s.truth.delay_s - s.frames[i].delay_s; };
  for (size_t i = 0; i + kApart < s.frames.size(); ++i) {
    squares += error(i) * error(i);
    products += error(i) * error(i + kApart);
  }
  const auto count = static_cast<double>(s.frames.size() - kApart);
  // Some 200 independent values: their rms is known to 5 %, a correlation to 0.07.
  EXPECT_NEAR(std::sqrt(squares / count), 3e-3, 0.6e-3);
  EXPECT_NEAR(products / squares, std::exp(-1.0), 0.25);
}

TEST(ClockEffects, ReadoutReversedByColumnsAndCurved) {
  Scenario scenario = NoiselessTracks();
  Reference reference;
  scenario.effects.readout_direction.reversed = true;
  reference.time = [](double stamp_s, double, const Vector2d& px) {
    return stamp_s + kTrueDelayS - kTrueReadoutS * px.y() / kHeightPx;
  };
  ExpectTracksFollow(reference, scenario);
  EXPECT_EQ(SimulateSensors(scenario)->truth.readout_s, -kTrueReadoutS);

  scenario = NoiselessTracks();
  scenario.effects.readout_direction.columns = true;
  reference.time = [](double stamp_s, double, const Vector2d& px) {
    return stamp_s + kTrueDelayS + kTrueReadoutS * px.x() / kWidthPx;
  };
  ExpectTracksFollow(reference, scenario);

  scenario = NoiselessTracks();
  scenario.effects.readout_nonlinear.curve = 0.1;
  reference.time = [](double stamp_s, double, const Vector2d& px) {
    const double s = px.y() / kHeightPx;
    return stamp_s + kTrueDelayS + kTrueReadoutS * (s + 0.4 * s * (1.0 - s));
  };
  ExpectTracksFollow(reference, scenario);
}

TEST(BaselineEffects, ShakeHasTheSpeedThatWasAskedAndLeavesTheRest) {
  Scenario scenario = NoiselessTracks();
  const Simulated calm = SimulateSensors(scenario).value();
  scenario.effects.translation_acceleration.shake_m_s = 0.6;
  const Simulated shaky = SimulateSensors(scenario).value();
  double sum = 0.0;
  const int count = 4000;
  for (int i = 0; i < count; ++i) {
    const CameraState a = calm.camera->trajectory().At(0.01 * i);
    const CameraState b = shaky.camera->trajectory().At(0.01 * i);
    EXPECT_EQ(a.omega_cam_rad_s, b.omega_cam_rad_s);
    sum += (b.v_world_m_s - a.v_world_m_s).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(sum / count), 0.6, 0.03);
}

// Full electronic stabilisation of a turning camera: every frame is a global-shutter picture of
// the directions, in one smooth orientation.
TEST(StabilisationEffects, ElectronicStabilisationTakesTheRotationOut) {
  Scenario scenario = NoiselessTracks();
  scenario.motion = MotionPreset(MotionKind::kRotation);
  scenario.effects.electronic_stabilisation = {1.0, 0.4};
  scenario.effects.radial_distortion.k1 = 0.0;
  const Simulated s = SimulateTracks(scenario).value();
  const Vector3d origin = s.frames[0].state.p_world_m;
  Matrix3d R_before = Matrix3d::Identity();
  double turned = 0.0, true_turn = 0.0;
  for (size_t i = 0; i < s.points.size(); ++i) {
    Matrix3d sum = Matrix3d::Zero();
    std::vector<Vector3d> rays, directions;
    for (size_t k = 0; k < s.points[i].size(); ++k) {
      const Vector2d px = s.recording.tracks[i][k].px;
      rays.push_back(
          Vector3d((px.x() - kTrueCx) / kTrueFocalPx, (px.y() - kTrueCy) / kTrueFocalPx, 1)
              .normalized());
      directions.push_back((s.points[i][k].world_m - origin).normalized());
      sum += directions.back() * rays.back().transpose();
    }
    ASSERT_GT(rays.size(), 50u);
    const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Matrix3d R = svd.matrixU() * svd.matrixV().transpose();  // Kabsch
    for (size_t k = 0; k < rays.size(); ++k) EXPECT_LT((R * rays[k] - directions[k]).norm(), 1e-9);
    if (i > 0) {
      turned += Eigen::AngleAxisd(R_before.transpose() * R).angle();
      true_turn += Eigen::AngleAxisd(s.frames[i - 1].state.R_world_cam.transpose() *
                                     s.frames[i].state.R_world_cam)
                       .angle();
    }
    R_before = R;
  }
  EXPECT_LT(turned, 0.35 * true_turn);
  // There and back.
  const Vector2d px(200.0, 400.0);
  const FrameTiming& timing = s.frames[20].timing;
  EXPECT_LT((*s.camera->Stabilise(timing, *s.camera->Destabilise(timing, px)) - px).norm(), 1e-6);
}

TEST(Effects, AllTogetherRun) {
  Scenario scenario;
  scenario.duration_s = 2.0;
  Effects& e = scenario.effects;
  e.radial_distortion.k1 = -0.1;
  e.tangential_distortion.p1 = 0.001;
  e.aspect_ratio.ratio = 1.01;
  e.focal_drift.rate_px_s = 0.5;
  e.optical_stabilisation.gain = 0.1;
  e.clock_skew.ppm = 300;
  e.delay_step = {1.0, 0.01};
  e.delay_wander.amplitude_s = 0.002;
  e.readout_direction.reversed = true;
  e.readout_nonlinear.curve = 0.05;
  e.gyro_scale.error = {0.01, 0.02, -0.01};
  e.gyro_misalignment.xy = 0.01;
  e.gyro_lowpass.time_constant_s = 0.004;
  e.gyro_saturation.limit_rad_s = 1.0;
  e.bias_drift.rate_rad_s2 = {1e-4, 0, 0};
  e.exposure_delay.factor = 0.5;
  e.translation_acceleration.shake_m_s = 0.3;
  e.electronic_stabilisation.strength = 0.5;
  EXPECT_EQ(ActiveEffects(e).size(), 18u);
  const Simulated s = SimulateTracks(scenario).value();
  for (const auto& tracks : s.recording.tracks) EXPECT_GT(tracks.size(), 90u);
}

}  // namespace
}  // namespace camgyro::simulation
