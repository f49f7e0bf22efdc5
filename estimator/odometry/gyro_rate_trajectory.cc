#include "estimator/odometry/gyro_rate_trajectory.h"

#include <algorithm>
#include <cstddef>

#include "core/imu_integral.h"
#include "core/so3.h"
#include "core/time.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

// Samples beyond the span on either side, which say how the parabola at its ends is bent.
constexpr std::ptrdiff_t kSamplesBeyond = 2;

template <typename Sample>
auto FirstFrom(const std::vector<Sample>& samples, int64_t stamp_ns) {
  return std::lower_bound(samples.begin(), samples.end(), stamp_ns,
                          [](const Sample& s, int64_t stamp) { return s.stamp_ns < stamp; });
}

template <typename Sample>
std::vector<Sample> Around(const std::vector<Sample>& samples, int64_t from_ns, int64_t to_ns) {
  const auto first = FirstFrom(samples, from_ns), last = FirstFrom(samples, to_ns);
  return {first - std::min(kSamplesBeyond, first - samples.begin()),
          last + std::min(kSamplesBeyond, samples.end() - last)};
}

// The way from one keyframe to the next one.
class Span {
 public:
  Span(const std::vector<GyroSample>& gyro, const std::vector<AccelSample>& accel,
       const OdometryPose& from, const OdometryPose& to, double gravity_m_s2)
      : from_(from),
        gravity_m_s2_(gravity_m_s2),
        span_s_(SecondsSince(from.time_ns, to.time_ns)),
        imu_(gyro, accel, from.time_ns, from.state.bias_gyro_rad_s, from.state.bias_accel_m_s2) {
    const NavigationState arrived = Predict(from.state, imu_.Between(0.0, span_s_), gravity_m_s2);
    rotation_ = Log(arrived.q_world_gyro.conjugate() * to.state.q_world_gyro);
    position_ = to.state.p_world_m - arrived.p_world_m;
    velocity_ = to.state.v_world_m_s - arrived.v_world_m_s;
  }

  StateAtTime At(int64_t time_ns) const {
    const double time_s = SecondsSince(from_.time_ns, time_ns);
    const double s = time_s / span_s_;
    StateAtTime at{time_ns, from_.segment,
                   Predict(from_.state, imu_.Between(0.0, time_s), gravity_m_s2_)};
    at.state.q_world_gyro = (at.state.q_world_gyro * Exp(Vector3d(s * rotation_))).normalized();
    at.state.p_world_m +=
        s * s * (3.0 - 2.0 * s) * position_ + s * s * (s - 1.0) * span_s_ * velocity_;
    at.state.v_world_m_s +=
        6.0 * s * (1.0 - s) / span_s_ * position_ + s * (3.0 * s - 2.0) * velocity_;
    return at;
  }

 private:
  const OdometryPose& from_;
  const double gravity_m_s2_, span_s_;
  const ImuIntegral imu_;
  Vector3d rotation_, position_, velocity_;
};

}  // namespace

std::vector<StateAtTime> AtGyroRate(const std::vector<GyroSample>& gyro,
                                    const std::vector<AccelSample>& accel,
                                    const std::vector<OdometryPose>& keyframes,
                                    double gravity_m_s2) {
  std::vector<StateAtTime> states;
  for (size_t k = 0; k + 1 < keyframes.size(); ++k) {
    const OdometryPose &from = keyframes[k], &to = keyframes[k + 1];
    if (from.segment != to.segment || from.time_ns >= to.time_ns) continue;
    const std::vector<GyroSample> rates = Around(gyro, from.time_ns, to.time_ns);
    const std::vector<AccelSample> forces = Around(accel, from.time_ns, to.time_ns);
    if (rates.size() < 2 || forces.empty()) continue;
    const Span span(rates, forces, from, to, gravity_m_s2);
    const auto end = FirstFrom(gyro, to.time_ns);
    for (auto sample = FirstFrom(gyro, from.time_ns); sample != end; ++sample) {
      states.push_back(span.At(sample->stamp_ns));
    }
  }
  return states;
}

}  // namespace camgyro
