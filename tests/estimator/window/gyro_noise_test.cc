#include "estimator/window/gyro_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "core/time.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

Recording Walk(double density_rad_s_rtHz, double rate_hz = 200.0) {
  simulation::Scenario scenario = ShortScenario(4.0);
  scenario.gyro.rate_hz = rate_hz;
  scenario.gyro.noise_density_rad_s_rtHz = density_rad_s_rtHz;
  Recording recording = simulation::SimulateTracks(scenario).value().recording;
  recording.gyro_info.noise_density_rad_s_rtHz.reset();
  return recording;
}

double RatioOf(const Eigen::Vector3d& sigma, int axis, double density_rad_s_rtHz, double rate_hz) {
  return sigma[axis] / (density_rad_s_rtHz * std::sqrt(rate_hz));
}

TEST(GyroSigma, IsWhatTheSamplesShowWhereNothingIsDeclared) {
  for (const double density : {2.1e-4, 4e-3}) {
    for (const double rate_hz : {200.0, 800.0}) {
      const Eigen::Vector3d shown = GyroSigma(Walk(density, rate_hz), 0.0);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(RatioOf(shown, k, density, rate_hz), 1.0, 0.15) << density << ' ' << rate_hz;
      }
    }
  }
}

TEST(GyroSigma, IsAsDeclared) {
  Recording recording = Walk(2.1e-4);
  for (const double density : {4e-5, 5e-4}) {
    recording.gyro_info.noise_density_rad_s_rtHz = density;
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(RatioOf(GyroSigma(recording, 0.0), k, density, 200.0), 1.0, 1e-6);
    }
  }
}

// Rotors that turn a camera to and fro at 93 Hz, as on the drone of EuRoC: 0.15 mrad, where white
// noise of such samples would make 2 mrad of 0.2 s.
TEST(GyroSigma, TakesVibrationForLessThanWhiteNoise) {
  constexpr double kPi = 3.14159265358979323846;
  Recording recording = Walk(2.1e-4);
  const Eigen::Vector3d still = GyroSigma(recording, 0.0);
  const int64_t origin_ns = recording.gyro.front().stamp_ns;
  for (GyroSample& sample : recording.gyro) {
    const double time_s = SecondsSince(origin_ns, sample.stamp_ns);
    sample.omega_gyro_rad_s.y() += 0.09 * std::sin(2.0 * kPi * 93.0 * time_s);
  }
  const Eigen::Vector3d shaken = GyroSigma(recording, 0.0);
  EXPECT_EQ(shaken.x(), still.x());
  EXPECT_GE(shaken.y(), still.y());
  EXPECT_LT(shaken.y(), 0.25 * 0.09 / std::sqrt(2.0));
}

// A gyro at rest that reports steps of its resolution.
TEST(GyroSigma, OfSamplesThatAreAllTheSameIsNotZero) {
  Recording recording = Walk(2.1e-4);
  for (GyroSample& sample : recording.gyro) sample.omega_gyro_rad_s.setConstant(0.001);
  EXPECT_EQ(GyroSigma(recording, 0.0), Eigen::Vector3d::Constant(5e-4));
  recording.gyro.resize(2);
  EXPECT_EQ(GyroSigma(recording, 0.0), Eigen::Vector3d::Constant(5e-4));
}

}  // namespace
}  // namespace camgyro
