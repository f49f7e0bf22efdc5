// Pre-integration against a motion with a closed form, and against differences and samples.
#include "core/imu_integral.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "core/so3.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int64_t kOriginNs = 7'000'000'000;
const Vector3d kGravity(0.3, 9.0, -2.0);

// Turns about two axes one after the other in closed form, and swings: everything is excited.
struct Motion {
  static Quaterniond Rotation(double t) {
    return Exp(Vector3d(0.0, 0.0, 0.8 * t)) * Exp(Vector3d(0.5 * t, 0.0, 0.0));
  }
  static Vector3d Rate(double t) {  // of R' = R [w]: the first rotation's rate seen from the body
    return Exp(Vector3d(-0.5 * t, 0.0, 0.0)) * Vector3d(0.0, 0.0, 0.8) + Vector3d(0.5, 0.0, 0.0);
  }
  static Vector3d Position(double t) { return {std::sin(2.0 * t), 0.4 * t * t, std::cos(3.0 * t)}; }
  static Vector3d Velocity(double t) {
    return {2.0 * std::cos(2.0 * t), 0.8 * t, -3.0 * std::sin(3.0 * t)};
  }
  static Vector3d Acceleration(double t) {
    return {-4.0 * std::sin(2.0 * t), 0.8, -9.0 * std::cos(3.0 * t)};
  }
};

struct Samples {
  std::vector<GyroSample> gyro;
  std::vector<AccelSample> accel;
};

// accel_shift_ns moves the accelerometer's sampling times against the gyro's.
Samples Sample(double rate_hz, double seconds, int64_t accel_shift_ns = 0) {
  Samples samples;
  for (int i = 0; i <= static_cast<int>(seconds * rate_hz); ++i) {
    const auto stamp_ns = kOriginNs + static_cast<int64_t>(std::llround(i * 1e9 / rate_hz));
    samples.gyro.push_back({stamp_ns, Motion::Rate(i / rate_hz)});
    const double t = i / rate_hz + 1e-9 * static_cast<double>(accel_shift_ns);
    samples.accel.push_back({stamp_ns + accel_shift_ns, Motion::Rotation(t).conjugate() *
                                                            (Motion::Acceleration(t) - kGravity)});
  }
  return samples;
}

void ExpectMotion(const ImuDelta& delta, double from_s, double to_s, double tolerance) {
  const Quaterniond q_i = Motion::Rotation(from_s), q_j = Motion::Rotation(to_s);
  const double dt = to_s - from_s;
  EXPECT_LT(delta.q_i_j.angularDistance(q_i.conjugate() * q_j), tolerance);
  const Vector3d dv =
      q_i.conjugate() * (Motion::Velocity(to_s) - Motion::Velocity(from_s) - kGravity * dt);
  EXPECT_LT((delta.dv - dv).norm(), tolerance);
  const Vector3d dp = q_i.conjugate() * (Motion::Position(to_s) - Motion::Position(from_s) -
                                         Motion::Velocity(from_s) * dt - 0.5 * dt * dt * kGravity);
  EXPECT_LT((delta.dp - dp).norm(), tolerance);
}

TEST(ImuIntegral, AgreesWithTheClosedForm) {
  const Samples s = Sample(200.0, 2.0);
  const ImuIntegral imu(s.gyro, s.accel, kOriginNs, Vector3d::Zero());
  // Trapezoids of a 9 m/s^2 swing at 3 rad/s would err by 9 * 9 * (5 ms)^2 / 12 = 2e-4 m/s^2.
  ExpectMotion(imu.Between(0.1, 1.9), 0.1, 1.9, 1e-7);
  ExpectMotion(imu.Between(0.7031, 0.7217), 0.7031, 0.7217, 1e-8);  // within and across samples
  ExpectMotion(imu.Between(1.5, 1.2), 1.5, 1.2, 1e-7);              // backwards
  EXPECT_EQ(imu.Between(0.4, 0.4).dp.norm(), 0.0);
}

TEST(ImuIntegral, ErrorShrinksWithTheFourthPowerOfTheInterval) {
  const auto error = [](double rate_hz) {
    const Samples s = Sample(rate_hz, 2.0);
    const ImuDelta delta =
        ImuIntegral(s.gyro, s.accel, kOriginNs, Vector3d::Zero()).Between(0.0, 1.7);
    const Vector3d dv = Motion::Velocity(1.7) - Motion::Velocity(0.0) - kGravity * 1.7;
    return (delta.dv - dv).norm();
  };
  EXPECT_NEAR(error(50.0) / error(200.0), 256.0, 50.0);
}

TEST(ImuIntegral, AccelerometerMayHaveItsOwnStamps) {
  const Samples s = Sample(200.0, 2.0, 2'300'000);
  const ImuIntegral imu(s.gyro, s.accel, kOriginNs, Vector3d::Zero());
  ExpectMotion(imu.Between(0.1, 1.9), 0.1, 1.9, 1e-5);
}

// A hand's tremor: of an angle that swings at 8 Hz nothing must be missing.
TEST(ImuIntegral, KeepsWhatSwingsFast) {
  const double w = 2.0 * M_PI * 8.0;
  std::vector<GyroSample> gyro;
  for (int i = 0; i <= 200; ++i) {
    gyro.push_back({kOriginNs + i * 5'000'000, Vector3d(w * std::cos(w * 5e-3 * i), 0.0, 0.0)});
  }
  const ImuIntegral imu(gyro, {}, kOriginNs, Vector3d::Zero());
  for (const double t : {0.3333, 0.4712, 0.5555}) {
    EXPECT_NEAR(Log(imu.Between(0.2, t).q_i_j)[0], std::sin(w * t) - std::sin(w * 0.2), 2e-4) << t;
    EXPECT_NEAR(imu.RateAt(t)[0], w * std::cos(w * t), 2e-3 * w) << t;
  }
}

// Second differences over steps of different length would make a rotation of their noise.
TEST(ImuIntegral, IsStraightWhereStepsAreUneven) {
  std::vector<GyroSample> gyro;
  for (const int64_t us : {0, 5000, 10000, 10010, 15000, 20000}) {
    gyro.push_back({kOriginNs + 1000 * us, Vector3d(us == 10010 ? 1.0 : 0.0, 0.0, 0.0)});
  }
  const ImuIntegral imu(gyro, {}, kOriginNs, Vector3d::Zero());
  EXPECT_NEAR(Log(imu.Between(0.0, 0.02).q_i_j)[0], 0.0025, 1e-3);  // of 0.4 they would make
}

TEST(ImuIntegral, WithoutAccelerometerOnlyTurns) {
  const Samples s = Sample(200.0, 1.0);
  const ImuDelta delta = ImuIntegral(s.gyro, {}, kOriginNs, Vector3d::Zero()).Between(0.0, 1.0);
  EXPECT_LT(delta.q_i_j.angularDistance(Motion::Rotation(1.0)), 1e-5);
  EXPECT_EQ(delta.dv.norm(), 0.0);
}

TEST(ImuIntegral, DerivativesByTheBiasesMatchDifferences) {
  const Samples s = Sample(200.0, 2.0);
  const Vector3d bg(0.01, -0.02, 0.03), ba(0.2, -0.1, 0.05);
  const double from_s = 0.3021, to_s = 1.4333, h = 1e-6;
  const ImuDelta at = ImuIntegral(s.gyro, s.accel, kOriginNs, bg, ba).Between(from_s, to_s);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = h * Vector3d::Unit(axis);
    const ImuDelta g = ImuIntegral(s.gyro, s.accel, kOriginNs, bg + step, ba).Between(from_s, to_s);
    const ImuDelta a = ImuIntegral(s.gyro, s.accel, kOriginNs, bg, ba + step).Between(from_s, to_s);
    // One-sided differences: 1e-5 is their second-order term.
    EXPECT_LT((Log(Quaterniond(at.q_i_j.conjugate() * g.q_i_j)) / h - at.J_rot_bias_gyro.col(axis))
                  .norm(),
              1e-5);
    EXPECT_LT(((g.dv - at.dv) / h - at.J_dv_bias_gyro.col(axis)).norm(), 1e-4);
    EXPECT_LT(((g.dp - at.dp) / h - at.J_dp_bias_gyro.col(axis)).norm(), 1e-4);
    EXPECT_LT(((a.dv - at.dv) / h - at.J_dv_bias_accel.col(axis)).norm(), 1e-6);
    EXPECT_LT(((a.dp - at.dp) / h - at.J_dp_bias_accel.col(axis)).norm(), 1e-6);
  }
}

TEST(ImuIntegral, CovarianceIsThatOfNoisySamples) {
  const double rate_hz = 200.0, from_s = 0.2, to_s = 0.8;
  const ImuNoise noise = {2e-3, 2e-2};
  const Samples clean = Sample(rate_hz, 1.0);
  const ImuIntegral truth(clean.gyro, clean.accel, kOriginNs, Vector3d::Zero());
  const ImuDelta expected = truth.Between(from_s, to_s);
  const ImuIntegral::Matrix9d covariance = truth.Covariance(from_s, to_s, noise);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Vector3d(sigma * Vector3d(x, y, z));
  };
  ImuIntegral::Matrix9d sampled = ImuIntegral::Matrix9d::Zero();
  const int runs = 400;
  for (int run = 0; run < runs; ++run) {
    Samples s = clean;
    for (auto& x : s.gyro) x.omega_gyro_rad_s += draw(noise.gyro_rad_s_rtHz * std::sqrt(rate_hz));
    for (auto& x : s.accel) x.accel_gyro_m_s2 += draw(noise.accel_m_s2_rtHz * std::sqrt(rate_hz));
    const ImuDelta d =
        ImuIntegral(s.gyro, s.accel, kOriginNs, Vector3d::Zero()).Between(from_s, to_s);
    Eigen::Matrix<double, 9, 1> e;
    e << Log(Quaterniond(expected.q_i_j.conjugate() * d.q_i_j)), d.dv - expected.dv,
        d.dp - expected.dp;
    sampled += e * e.transpose() / runs;
  }
  // 400 samples: a variance is known to 7 %.
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(sampled(i, i) / covariance(i, i), 1.0, 0.25) << i;
  for (int i = 0; i < 3; ++i) {  // velocity and position go together
    const double scale = std::sqrt(covariance(3 + i, 3 + i) * covariance(6 + i, 6 + i));
    EXPECT_NEAR(sampled(3 + i, 6 + i) / scale, covariance(3 + i, 6 + i) / scale, 0.1);
  }
}

}  // namespace
}  // namespace camgyro
