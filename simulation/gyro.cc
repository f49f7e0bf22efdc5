#include "simulation/gyro.h"

#include <algorithm>
#include <cmath>

#include "core/so3.h"
#include "core/time.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// What the element sees at the sampling times: the rate in the gyro frame, of each axis at its
// time, low-passed if asked.
class Element {
 public:
  Element(const Scenario& scenario, const Trajectory& trajectory)
      : trajectory_(trajectory),
        R_gyro_cam_(scenario.mount.q_gyro_cam.toRotationMatrix()),
        axis_delay_(scenario.effects.gyro_axis_delay),
        time_constant_s_(scenario.effects.gyro_lowpass.time_constant_s) {
    if (time_constant_s_ > 0.0) {  // settled before the first sample is read
      time_s_ = -1.0;
      filtered_ = Rate(time_s_);
    }
  }

  // Times must not decrease.
  Vector3d At(double time_s) {
    if (time_constant_s_ <= 0.0) return Rate(time_s);
    // y' = (w - y) / T over steps of at most 0.5 ms and T / 2: exact decay, Simpson's rule for the
    // input. Over longer steps than T the decay is no polynomial, and the rule makes the rate
    // larger.
    const double longest_s = std::min(5e-4, 0.5 * time_constant_s_);
    const int steps = static_cast<int>(std::ceil((time_s - time_s_) / longest_s));
    const double h = steps > 0 ? (time_s - time_s_) / steps : 0.0;
    const double whole = std::exp(-h / time_constant_s_);
    const double half = std::exp(-0.5 * h / time_constant_s_);
    for (int i = 0; i < steps; ++i, time_s_ += h) {
      filtered_ =
          whole * filtered_ +
          h / (6.0 * time_constant_s_) *
              (whole * Rate(time_s_) + 4.0 * half * Rate(time_s_ + 0.5 * h) + Rate(time_s_ + h));
    }
    time_s_ = time_s;
    return filtered_;
  }

 private:
  Vector3d Rate(double time_s) const {
    Vector3d rate = AllAxes(time_s);
    if (axis_delay_.active()) {
      rate.y() = AllAxes(time_s - axis_delay_.y_after_x_s).y();
      rate.z() = AllAxes(time_s - axis_delay_.z_after_x_s).z();
    }
    return rate;
  }
  Vector3d AllAxes(double time_s) const {
    return R_gyro_cam_ * trajectory_.At(time_s).omega_cam_rad_s;
  }

  const Trajectory& trajectory_;
  Matrix3d R_gyro_cam_;
  GyroAxisDelay axis_delay_;
  double time_constant_s_;
  double time_s_ = 0.0;
  Vector3d filtered_ = Vector3d::Zero();
};

class Normal {
 public:
  explicit Normal(std::mt19937_64* random) : random_(random) {}
  double operator()() { return normal_(*random_); }
  Vector3d Vector() {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }

 private:
  std::mt19937_64* random_;
  std::normal_distribution<double> normal_;
};

// The accelerometer's bias, a random walk. Its random numbers are its own, so that switching it on
// leaves everything else as it was.
class AccelBias {
 public:
  explicit AccelBias(const Scenario& scenario)
      : bias_m_s2_(scenario.gyro.accel_bias_m_s2),
        step_m_s2_(scenario.gyro.accel_bias_walk_m_s3_rtHz / std::sqrt(scenario.gyro.rate_hz)) {
    constexpr uint32_t kStream = 200;  // simulate.cc counts from 0, render.cc from 100
    std::seed_seq sequence{static_cast<uint32_t>(scenario.seed),
                           static_cast<uint32_t>(scenario.seed >> 32), kStream};
    random_.seed(sequence);
  }

  Vector3d Next() {
    const Vector3d bias = bias_m_s2_;
    bias_m_s2_ += step_m_s2_ * normal_.Vector();
    return bias;
  }

 private:
  std::mt19937_64 random_;
  Normal normal_{&random_};
  Vector3d bias_m_s2_;
  double step_m_s2_;
};

// How late samples arrive, in their order: nothing overtakes. Its random numbers are its own, too.
class Arrivals {
 public:
  explicit Arrivals(const Scenario& scenario) : options_(scenario.gyro) {
    constexpr uint32_t kStream = 201;
    std::seed_seq sequence{static_cast<uint32_t>(scenario.seed),
                           static_cast<uint32_t>(scenario.seed >> 32), kStream};
    random_.seed(sequence);
  }

  // Latency of the next sample, which was taken at this time [s].
  double Next(double time_s) {
    double late_s = options_.stamp_latency_s * latency_(random_);
    const bool stalls = unit_(random_) * GyroOptions::kSamplesPerStall < 1.0;
    const double stall_s = options_.stamp_stall_s * unit_(random_);
    if (stalls) late_s += stall_s;
    last_s_ = std::max(last_s_, time_s + late_s);
    return last_s_ - time_s;
  }

 private:
  const GyroOptions& options_;
  std::mt19937_64 random_;
  std::exponential_distribution<double> latency_;
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
  double last_s_ = 0.0;
};

// What an accelerometer at the gyro feels, in the gyro frame [m/s^2].
Vector3d SpecificForce(const Scenario& scenario, const Trajectory& trajectory, double time_s) {
  const Matrix3d R_gyro_cam = scenario.mount.q_gyro_cam.toRotationMatrix();
  const Vector3d gravity_world(0.0, 9.80665, 0.0);
  const CameraState state = trajectory.At(time_s);
  const Vector3d omega = R_gyro_cam * state.omega_cam_rad_s;
  const Vector3d alpha = R_gyro_cam * state.alpha_cam_rad_s2;
  const Vector3d& arm = scenario.mount.p_gyro_cam_m;  // from the IMU to the camera
  return R_gyro_cam * (state.R_world_cam.transpose() * (state.a_world_m_s2 - gravity_world)) -
         alpha.cross(arm) - omega.cross(omega.cross(arm));
}

// When samples are taken.
std::vector<int64_t> SampleStamps(const Scenario& scenario) {
  std::vector<int64_t> stamps_ns;
  if (scenario.log != nullptr) {
    for (const int64_t time_ns : scenario.log->gyro_ns) {
      stamps_ns.push_back(scenario.start_ns + time_ns);
    }
    return stamps_ns;
  }
  const double rate_hz = scenario.gyro.rate_hz, dt = 1.0 / rate_hz;
  const auto count =
      static_cast<int64_t>(std::floor((scenario.duration_s + 2.0 * scenario.margin_s) * rate_hz)) +
      1;
  for (int64_t i = 0; i < count; ++i) {
    stamps_ns.push_back(StampAt(scenario.start_ns, static_cast<double>(i) * dt));
  }
  return stamps_ns;
}

}  // namespace

SimulatedGyro SimulateGyro(const Scenario& scenario, const Trajectory& trajectory,
                           std::mt19937_64* random) {
  const GyroOptions& options = scenario.gyro;
  const Effects& effects = scenario.effects;
  const double dt = 1.0 / options.rate_hz;
  const std::vector<int64_t> stamps_ns = SampleStamps(scenario);
  const size_t count = stamps_ns.size();

  Matrix3d M = Matrix3d::Identity();
  effects.ForEach([&](const auto& effect) { CallAddRateMatrix(effect, &M, 0); });
  const double sigma_rate = options.noise_density_rad_s_rtHz * std::sqrt(options.rate_hz);
  const double sigma_accel = options.accel_noise_density_m_s2_rtHz * std::sqrt(options.rate_hz);
  const double sigma_walk = options.bias_walk_rad_s2_rtHz * std::sqrt(dt);

  Element element(scenario, trajectory);
  Normal normal(random);
  AccelBias accel_bias(scenario);
  Arrivals arrivals(scenario);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  SimulatedGyro result;
  Vector3d walk = Vector3d::Zero();
  for (size_t i = 0; i < count; ++i) {
    const int64_t sampled_ns = stamps_ns[i];
    const double time_s = SecondsSince(scenario.start_ns, sampled_ns);
    Vector3d bias = options.bias_rad_s + walk;
    effects.ForEach([&](const auto& effect) { CallAddBias(effect, time_s, &bias, 0); });
    result.times_s.push_back(time_s);
    result.bias_rad_s.push_back(bias);
    walk += sigma_walk * normal.Vector();

    Vector3d rate = Vector3d::Zero();
    if (options.averaged) {  // Gauss-Legendre, 3 points over the interval about the stamp
      const double offset = 0.5 * dt * std::sqrt(0.6);
      rate = 5.0 / 18.0 * element.At(time_s - offset);  // one after the other: as time goes
      rate += 8.0 / 18.0 * element.At(time_s);
      rate += 5.0 / 18.0 * element.At(time_s + offset);
    } else {
      rate = element.At(time_s);
    }
    rate = M * rate + bias + sigma_rate * normal.Vector();
    const RateInput input = {time_s, SpecificForce(scenario, trajectory, time_s)};
    effects.ForEach([&](const auto& effect) { CallAddRate(effect, input, &rate, 0); });
    const double limit = effects.gyro_saturation.limit_rad_s;
    if (limit > 0.0) rate = rate.cwiseMax(-limit).cwiseMin(limit);
    if (options.quantum_rad_s > 0.0) {
      for (double& axis : rate)
        axis = std::round(axis / options.quantum_rad_s) * options.quantum_rad_s;
    }

    // Draws are the same whatever is switched on, so that recordings differ by the effect alone.
    const Vector3d accel_error = accel_bias.Next() + sigma_accel * normal.Vector();
    const double jitter_s = options.stamp_jitter_s * normal() + arrivals.Next(time_s);
    if (unit(*random) < options.drop_fraction && i > 0 && i + 1 < count) continue;
    int64_t stamp_ns =
        sampled_ns + (i > 0 ? static_cast<int64_t>(std::llround(jitter_s * 1e9)) : 0);
    if (!result.gyro.empty()) stamp_ns = std::max(stamp_ns, result.gyro.back().stamp_ns + 1000);
    result.gyro.push_back({stamp_ns, rate});
    if (options.accelerometer) {
      result.accel.push_back({stamp_ns, input.force_m_s2 + accel_error});
    }
  }
  return result;
}

}  // namespace camgyro::simulation
