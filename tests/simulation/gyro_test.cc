#include "simulation/gyro.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "core/time.h"
#include "simulation/simulate.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// One tone about the camera's y axis: omega_y = a sin(w t), through the interface of trajectories.
class Tone final : public Trajectory {
 public:
  Tone(double amplitude_rad_s, double frequency_hz)
      : a_(amplitude_rad_s), w_(2.0 * M_PI * frequency_hz) {}
  CameraState At(double t) const override {
    const Vector3d axis = Vector3d::UnitY();
    return {Eigen::AngleAxisd(a_ / w_ * (1.0 - std::cos(w_ * t)), axis).toRotationMatrix(),
            Vector3d::Zero(),
            Vector3d::Zero(),
            Vector3d::Zero(),
            a_ * std::sin(w_ * t) * axis,
            a_ * w_ * std::cos(w_ * t) * axis};
  }

 private:
  double a_, w_;
};

Scenario Quiet() {
  Scenario scenario;
  scenario.gyro.noise_density_rad_s_rtHz = 0.0;
  scenario.gyro.bias_walk_rad_s2_rtHz = 0.0;
  scenario.gyro.bias_rad_s.setZero();
  scenario.mount.q_gyro_cam.setIdentity();
  return scenario;
}

SimulatedGyro SampleGyro(const Scenario& scenario, const Trajectory& trajectory) {
  std::mt19937_64 random(1);
  return SimulateGyro(scenario, trajectory, &random);
}

double TimeOf(const Scenario& scenario, const GyroSample& sample) {
  return SecondsSince(scenario.start_ns, sample.stamp_ns);
}

// The accelerometer's bias is where it is set at first, walks as far as its density says, and
// leaves all other random numbers as they were.
TEST(Gyro, AccelerometerHasABiasThatWalks) {
  Scenario scenario;
  const Tone tone(1.5, 2.0);
  const SimulatedGyro without = SampleGyro(scenario, tone);
  scenario.gyro.accel_bias_m_s2 = {0.1, -0.2, 0.05};
  scenario.gyro.accel_bias_walk_m_s3_rtHz = 0.03;
  const SimulatedGyro with = SampleGyro(scenario, tone);
  ASSERT_EQ(with.accel.size(), without.accel.size());
  const auto bias = [&](size_t i) -> Vector3d {
    return with.accel[i].accel_gyro_m_s2 - without.accel[i].accel_gyro_m_s2;
  };
  EXPECT_LT((bias(0) - scenario.gyro.accel_bias_m_s2).norm(), 1e-12);
  double squared = 0.0;
  for (size_t i = 1; i < with.accel.size(); ++i) {
    EXPECT_EQ(with.gyro[i].omega_gyro_rad_s, without.gyro[i].omega_gyro_rad_s);
    squared += (bias(i) - bias(i - 1)).squaredNorm() / 3.0;
  }
  // 6600 steps: their mean square is known to 1.7 %.
  const double expected = 0.03 * 0.03 / scenario.gyro.rate_hz;
  EXPECT_NEAR(squared / static_cast<double>(with.accel.size() - 1), expected, 0.07 * expected);
}

TEST(Gyro, MeasuresTheRateInItsOwnFrameWithBias) {
  Scenario scenario = Quiet();
  scenario.mount.q_gyro_cam = MountOptions::DefaultRotation();
  scenario.gyro.bias_rad_s = {0.1, -0.2, 0.3};
  const Tone tone(1.5, 2.0);
  const SimulatedGyro result = SampleGyro(scenario, tone);
  ASSERT_EQ(result.gyro.size(), 2201u);  // 11 s at 200 Hz, both ends
  for (const GyroSample& sample : result.gyro) {
    const double t = TimeOf(scenario, sample);
    const Vector3d expected =
        scenario.mount.q_gyro_cam * Vector3d(0, 1.5 * std::sin(4.0 * M_PI * t), 0) +
        Vector3d(0.1, -0.2, 0.3);
    EXPECT_LT((sample.omega_gyro_rad_s - expected).norm(), 1e-12);
  }
}

TEST(Gyro, LowPassDelaysAndAttenuatesAsTheoryOfTheFirstOrderSays) {
  for (const double time_constant_s : {0.008, 0.00015}) {  // slow and fast beside the samples
    Scenario scenario = Quiet();
    scenario.effects.gyro_lowpass.time_constant_s = time_constant_s;
    const double w = 2.0 * M_PI * 5.0;
    const SimulatedGyro result = SampleGyro(scenario, Tone(1.0, 5.0));
    const double gain = 1.0 / std::sqrt(1.0 + std::pow(w * time_constant_s, 2));
    const double lag = std::atan(w * time_constant_s);
    const double within = time_constant_s < 1e-3 ? 5e-5 : 1e-7;  // the rule's error at T / 2
    for (const GyroSample& sample : result.gyro) {
      const double t = TimeOf(scenario, sample);
      EXPECT_NEAR(sample.omega_gyro_rad_s.y(), gain * std::sin(w * t - lag), within);
    }
  }
}

TEST(Gyro, ReadsItsAxesOneAfterTheOther) {
  Scenario scenario = Quiet();
  scenario.mount.q_gyro_cam = MountOptions::DefaultRotation();
  scenario.effects.gyro_axis_delay = {0.002, -0.003};
  const double w = 2.0 * M_PI * 2.0;
  const Vector3d axis = scenario.mount.q_gyro_cam * Vector3d(0, 1.5, 0);
  for (const GyroSample& sample : SampleGyro(scenario, Tone(1.5, 2.0)).gyro) {
    const double t = TimeOf(scenario, sample);
    const Vector3d expected(axis.x() * std::sin(w * t), axis.y() * std::sin(w * (t - 0.002)),
                            axis.z() * std::sin(w * (t + 0.003)));
    EXPECT_LT((sample.omega_gyro_rad_s - expected).norm(), 1e-12);
  }
}

TEST(Gyro, AveragingAttenuatesWithoutDelay) {
  Scenario scenario = Quiet();
  scenario.gyro.averaged = true;
  scenario.gyro.rate_hz = 100.0;
  const double w = 2.0 * M_PI * 10.0, x = 0.5 * w * 0.01;
  const SimulatedGyro result = SampleGyro(scenario, Tone(1.0, 10.0));
  for (const GyroSample& sample : result.gyro) {
    const double t = TimeOf(scenario, sample);
    EXPECT_NEAR(sample.omega_gyro_rad_s.y(), std::sin(x) / x * std::sin(w * t), 1e-6);
  }
}

TEST(Gyro, AveragesWhatTheLowPassLeaves) {
  Scenario scenario = Quiet();
  scenario.gyro.averaged = true;
  scenario.gyro.rate_hz = 100.0;
  scenario.effects.gyro_lowpass.time_constant_s = 0.004;
  const double w = 2.0 * M_PI * 5.0, x = 0.5 * w * 0.01;
  const double gain = std::sin(x) / x / std::sqrt(1.0 + w * w * 0.004 * 0.004);
  const double lag = std::atan(w * 0.004);
  for (const GyroSample& sample : SampleGyro(scenario, Tone(1.0, 5.0)).gyro) {
    const double t = TimeOf(scenario, sample);
    EXPECT_NEAR(sample.omega_gyro_rad_s.y(), gain * std::sin(w * t - lag), 1e-6);
  }
}

TEST(Gyro, ScaleMisalignmentClippingAndQuantisation) {
  Scenario scenario = Quiet();
  scenario.effects.gyro_scale.error = {0.1, 0.02, 0.3};
  scenario.effects.gyro_misalignment = {0.01, 0.05, -0.02};
  const Tone tone(2.0, 1.0);
  for (const GyroSample& sample : SampleGyro(scenario, tone).gyro) {
    const double y = 2.0 * std::sin(2.0 * M_PI * TimeOf(scenario, sample));
    // Second column of I + diag(scale) + S.
    EXPECT_LT((sample.omega_gyro_rad_s - Vector3d(0.01, 1.02, -0.02) * y).norm(), 1e-12);
  }
  scenario = Quiet();
  scenario.effects.gyro_saturation.limit_rad_s = 1.2;
  int railed = 0;
  for (const GyroSample& sample : SampleGyro(scenario, tone).gyro) {
    const double y = 2.0 * std::sin(2.0 * M_PI * TimeOf(scenario, sample));
    EXPECT_NEAR(sample.omega_gyro_rad_s.y(), std::max(-1.2, std::min(1.2, y)), 1e-12);
    railed += std::abs(sample.omega_gyro_rad_s.y()) == 1.2;
  }
  EXPECT_NEAR(railed / 2201.0, 2.0 / M_PI * std::acos(0.6), 0.01);
  scenario = Quiet();
  scenario.gyro.quantum_rad_s = 0.01;
  for (const GyroSample& sample : SampleGyro(scenario, tone).gyro) {
    const double steps = sample.omega_gyro_rad_s.y() / 0.01;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
    const double y = 2.0 * std::sin(2.0 * M_PI * TimeOf(scenario, sample));
    EXPECT_LE(std::abs(sample.omega_gyro_rad_s.y() - y), 0.005 + 1e-12);
  }
}

TEST(Gyro, NoiseAndWalkHaveTheirDensities) {
  Scenario scenario = Quiet();
  scenario.duration_s = 200.0;
  scenario.gyro.noise_density_rad_s_rtHz = 1e-3;
  scenario.gyro.bias_walk_rad_s2_rtHz = 2e-3;
  const Tone still(0.0, 1.0);
  const SimulatedGyro result = SampleGyro(scenario, still);
  double noise = 0.0, walk = 0.0;
  for (size_t i = 1; i < result.gyro.size(); ++i) {
    noise += (result.gyro[i].omega_gyro_rad_s - result.bias_rad_s[i]).squaredNorm() / 3.0;
    walk += (result.bias_rad_s[i] - result.bias_rad_s[i - 1]).squaredNorm() / 3.0;
  }
  const double n = static_cast<double>(result.gyro.size()) - 1.0;
  EXPECT_NEAR(std::sqrt(noise / n), 1e-3 * std::sqrt(200.0), 2e-4);
  EXPECT_NEAR(std::sqrt(walk / n), 2e-3 / std::sqrt(200.0), 2e-6);
}

TEST(Gyro, BiasDrifts) {
  Scenario scenario = Quiet();
  scenario.effects.bias_drift.rate_rad_s2 = {1e-3, 0, 0};
  scenario.effects.bias_drift.swing_rad_s = {0, 0.02, 0};
  scenario.effects.bias_drift.period_s = 8.0;
  const SimulatedGyro result = SampleGyro(scenario, Tone(0.0, 1.0));
  EXPECT_LT((result.gyro[400].omega_gyro_rad_s - Vector3d(2e-3, 0.02, 0)).norm(), 1e-12);  // 2 s
}

TEST(Gyro, StampsJitterAndDropButIncrease) {
  Scenario scenario = Quiet();
  scenario.gyro.stamp_jitter_s = 0.004;
  scenario.gyro.drop_fraction = 0.1;
  const SimulatedGyro result = SampleGyro(scenario, Tone(1.0, 1.0));
  EXPECT_NEAR(static_cast<double>(result.gyro.size()), 0.9 * 2201, 60);
  EXPECT_EQ(result.gyro.front().stamp_ns, scenario.start_ns);
  for (size_t i = 1; i < result.gyro.size(); ++i) {
    EXPECT_GT(result.gyro[i].stamp_ns, result.gyro[i - 1].stamp_ns);
  }
}

// Late by an exponential latency and, one in 200, by a stall; samples themselves stay as they were.
TEST(Gyro, StampsOfArrival) {
  Scenario scenario;
  scenario.duration_s = 100.0;
  const Tone tone(1.5, 2.0);
  const SimulatedGyro clean = SampleGyro(scenario, tone);
  scenario.gyro.stamp_latency_s = 1e-3;
  const SimulatedGyro late = SampleGyro(scenario, tone);
  scenario.gyro.stamp_stall_s = 0.03;
  const SimulatedGyro stalled = SampleGyro(scenario, tone);
  ASSERT_EQ(late.gyro.size(), clean.gyro.size());
  ASSERT_EQ(stalled.gyro.size(), clean.gyro.size());
  double sum = 0.0, longest = 0.0;
  int held_up = 0;
  for (size_t i = 0; i < clean.gyro.size(); ++i) {
    EXPECT_EQ(stalled.gyro[i].omega_gyro_rad_s, clean.gyro[i].omega_gyro_rad_s);
    const double usual = SecondsSince(clean.gyro[i].stamp_ns, late.gyro[i].stamp_ns);
    const double all = SecondsSince(clean.gyro[i].stamp_ns, stalled.gyro[i].stamp_ns);
    EXPECT_GE(usual, 0.0);
    EXPECT_GE(all, usual);
    sum += usual;
    longest = std::max(longest, all);
    if (all > usual + 1e-3) ++held_up;
  }
  const auto count = static_cast<double>(clean.gyro.size());
  // 20,000 draws: the mean is known to 0.7 %. Waiting for the one before adds exp(-5) of it.
  EXPECT_NEAR(sum / count, 1e-3, 0.04e-3);
  EXPECT_GT(longest, 0.025);
  EXPECT_LT(longest, 0.045);
  // A stall of up to 6 periods holds up 3 samples in the mean, itself included, and there is one
  // in 200.
  EXPECT_NEAR(held_up / count, 3.0 / 200.0, 0.006);
}

// Specific force: gravity at rest, and the lever arm's centripetal part when the camera's point
// is at rest and the device turns about it.
TEST(Gyro, AccelerometerMeasuresSpecificForceAtItsOwnPlace) {
  Scenario scenario = Quiet();
  scenario.gyro.accel_noise_density_m_s2_rtHz = 0.0;
  scenario.mount.p_gyro_cam_m = {0.0, 0.0, 0.1};
  const SimulatedGyro still = SampleGyro(scenario, Tone(0.0, 1.0));
  EXPECT_LT((still.accel[7].accel_gyro_m_s2 - Vector3d(0, -9.80665, 0)).norm(), 1e-12);
  const SimulatedGyro turning = SampleGyro(scenario, Tone(2.0, 1.0));
  const size_t crest = 50;  // 0.25 s: omega = 2 rad/s, alpha = 0
  // The IMU is 0.1 m behind the camera, and accelerates towards it: omega^2 r along +z.
  EXPECT_LT((turning.accel[crest].accel_gyro_m_s2 - Vector3d(0, -9.80665, 0.4)).norm(), 1e-9);
}

}  // namespace
}  // namespace camgyro::simulation
