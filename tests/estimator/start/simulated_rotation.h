// A small world of our own for the start: smooth random angular rates, sampled by a gyro, and the
// exact camera rotations between frames.
#ifndef CAMGYRO_TESTS_ESTIMATOR_START_SIMULATED_ROTATION_H_
#define CAMGYRO_TESTS_ESTIMATOR_START_SIMULATED_ROTATION_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "core/recording.h"
#include "core/so3.h"

namespace camgyro {

// Rate in the gyro frame [rad/s] at a time on the gyro's clock [s].
using RateFunction = std::function<Eigen::Vector3d(double)>;

// Sum of sines of 0.2-3 Hz with random phases and directions; about `rms_rad_s` for the vector.
inline RateFunction SmoothRandomRate(int seed, double rms_rad_s) {
  struct Sine {
    Eigen::Vector3d amplitude;
    double omega, phase;
  };
  std::mt19937 random(static_cast<unsigned>(seed));
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal;
  std::vector<Sine> sines;
  constexpr int kSines = 24;
  for (int k = 0; k < kSines; ++k) {
    const Eigen::Vector3d direction{normal(random), normal(random), normal(random)};
    const double hz = 0.2 * std::pow(15.0, uniform(random));
    sines.push_back({direction * rms_rad_s * std::sqrt(2.0 / (3.0 * kSines)), 2.0 * M_PI * hz,
                     2.0 * M_PI * uniform(random)});
  }
  return [sines](double t) {
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    for (const Sine& s : sines) rate += s.amplitude * std::sin(s.omega * t + s.phase);
    return rate;
  };
}

struct SimulatedTruth {
  double delay_s = 0.0;  // t_gyro = t_camera + delay
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  double duration_s = 10.0;
  double fps = 30.0;
  double gyro_hz = 200.0;
  double camera_noise_rad = 0.0;  // per axis and pair
  double gyro_noise_rad_s = 0.0;  // per sample and axis
  int64_t first_frame_ns = 1'000'000'000;
};

struct Simulated {
  Recording recording;
  std::vector<CameraRotation> rotations;
};

// Gyro from 0.5 s before the first frame to 0.5 s after the last one, on the gyro's clock.
inline Simulated Simulate(const RateFunction& rate, const SimulatedTruth& truth, int seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  const auto noise = [&] {
    return Eigen::Vector3d{normal(random), normal(random), normal(random)};
  };
  Simulated out;
  const double start_s = 1e-9 * static_cast<double>(truth.first_frame_ns) + truth.delay_s;
  const int frames = static_cast<int>(truth.duration_s * truth.fps) + 1;
  for (int i = 0; i < frames; ++i) {
    Frame frame;
    frame.stamp_ns = truth.first_frame_ns + std::llround(1e9 * i / truth.fps);
    out.recording.frames.push_back(frame);
  }
  const int samples = static_cast<int>((truth.duration_s + 1.0) * truth.gyro_hz);
  for (int k = 0; k < samples; ++k) {
    const double since_s = -0.5 + k / truth.gyro_hz;
    GyroSample sample;
    sample.stamp_ns = std::llround(1e9 * (start_s + since_s));
    sample.omega_gyro_rad_s =
        rate(since_s) + truth.bias_gyro_rad_s + truth.gyro_noise_rad_s * noise();
    out.recording.gyro.push_back(sample);
  }
  for (int i = 0; i + 1 < frames; ++i) {
    // Midpoint rule in 40 steps: its error is far below what any test here asks for.
    constexpr int kSteps = 40;
    const double dt = 1.0 / truth.fps / kSteps;
    Eigen::Quaterniond q_a_b = Eigen::Quaterniond::Identity();
    for (int k = 0; k < kSteps; ++k) {
      const Eigen::Vector3d omega_cam =
          truth.q_gyro_cam.conjugate() * rate(i / truth.fps + (k + 0.5) * dt);
      q_a_b = q_a_b * Exp(Eigen::Vector3d(omega_cam * dt));
    }
    CameraRotation rotation;
    rotation.frame_a = i;
    rotation.frame_b = i + 1;
    rotation.q_a_b = q_a_b * Exp(Eigen::Vector3d(truth.camera_noise_rad * noise()));
    rotation.sigma_rad = truth.camera_noise_rad;
    out.rotations.push_back(rotation);
  }
  return out;
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_ESTIMATOR_START_SIMULATED_ROTATION_H_
