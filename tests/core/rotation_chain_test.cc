#include "core/rotation_chain.h"

#include <gmock/gmock.h>

#include <random>

#include "core/so3.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

struct Chain {
  std::vector<double> times;
  Matrix3Xd rates;
};

Chain RandomChain(uint64_t seed, int n) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> interval(0.004, 0.012);
  Chain chain;
  chain.rates.resize(3, n);
  double time = 0.3;
  for (int i = 0; i < n; ++i) {
    chain.times.push_back(time);
    time += interval(generator);
    chain.rates.col(i) = Vector3d{normal(generator), normal(generator), normal(generator)};
  }
  return chain;
}

// Independent of the chain: many small steps through the piecewise linear rate.
Matrix3d IntegrateFinely(const Chain& c, double from, double to) {
  const auto rate = [&](double t) -> Vector3d {
    if (t <= c.times.front()) return c.rates.col(0);
    if (t >= c.times.back()) return c.rates.col(c.rates.cols() - 1);
    size_t i = 0;
    while (c.times[i + 1] < t) ++i;
    const double w = (t - c.times[i]) / (c.times[i + 1] - c.times[i]);
    const auto col = static_cast<Eigen::Index>(i);
    return (1 - w) * c.rates.col(col) + w * c.rates.col(col + 1);
  };
  const int steps = 20000;
  const double h = (to - from) / steps;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (int i = 0; i < steps; ++i) q = q * Exp(Vector3d(h * rate(from + (i + 0.5) * h)));
  return q.toRotationMatrix();
}

TEST(RotationChain, AgreesWithFineIntegrationInsideAndOutside) {
  const Chain c = RandomChain(1, 9);
  const RotationChain chain(c.times, c.rates);
  for (const double t : {c.times[0], c.times[3], c.times[3] + 0.0017, c.times[8] - 1e-9, c.times[8],
                         c.times[8] + 0.004, c.times[0] - 0.003}) {
    const Matrix3d expected = IntegrateFinely(c, c.times[0], t);
    // The commutator within a segment is neglected: up to dt^2/12 |w0 x w1| ~ 2e-5 rad each.
    EXPECT_LT((chain.At(t).R_ref_gyro - expected).norm(), 1e-4) << t;
  }
}

TEST(RotationChain, IsExactForAConstantAxis) {
  Chain c = RandomChain(2, 9);
  const Vector3d axis = Vector3d(1, -2, 0.5).normalized();
  for (int i = 0; i < 9; ++i) c.rates.col(i) = axis * c.rates(0, i);
  const RotationChain chain(c.times, c.rates);
  for (const double t : {c.times[4] + 0.002, c.times[8] + 0.01, c.times[0] - 0.01}) {
    // 1e-7: steps of the midpoint rule that straddle a corner of the polygon.
    EXPECT_LT((chain.At(t).R_ref_gyro - IntegrateFinely(c, c.times[0], t)).norm(), 1e-7) << t;
  }
}

TEST(RotationChain, RateAndItsSlopeAreThoseOfThePolygon) {
  const Chain c = RandomChain(3, 5);
  const RotationChain chain(c.times, c.rates);
  const double dt = c.times[3] - c.times[2];
  const auto state = chain.At(c.times[2] + 0.25 * dt);
  EXPECT_LT((state.omega_gyro_rad_s - (0.75 * c.rates.col(2) + 0.25 * c.rates.col(3))).norm(),
            1e-12);
  EXPECT_LT((state.alpha_gyro_rad_s2 - (c.rates.col(3) - c.rates.col(2)) / dt).norm(), 1e-9);
  EXPECT_TRUE(chain.At(c.times[4] + 1.0).alpha_gyro_rad_s2.isZero());
}

TEST(RotationChain, GradientByRatesMatchesDifferences) {
  const Chain c = RandomChain(4, 8);
  const Vector3d x(0.3, -0.7, 0.2), weight_phi(1.0, -2.0, 0.5), weight_omega(0.1, 0.4, -0.3);
  for (const double t : {c.times[0] - 0.004, c.times[0] + 0.001, c.times[4], c.times[4] + 0.003,
                         c.times[7] + 0.005}) {
    const auto scalar = [&](const Matrix3Xd& rates) {
      const auto s = RotationChain(c.times, rates).At(t);
      return weight_phi.dot(s.R_ref_gyro * x) + weight_omega.dot(s.omega_gyro_rad_s);
    };
    const RotationChain chain(c.times, c.rates);
    const auto state = chain.At(t);
    // d(R x) = phi x (R x), so the derivative of weight.(R x) by phi is (R x) x weight.
    const Vector3d by_phi = (state.R_ref_gyro * x).cross(weight_phi);
    Matrix3Xd gradient = Matrix3Xd::Zero(3, 8);
    chain.AddRateGradient(state, by_phi, weight_omega, gradient);
    for (int n = 0; n < 8; ++n) {
      for (int k = 0; k < 3; ++k) {
        Matrix3Xd plus = c.rates, minus = c.rates;
        plus(k, n) += 1e-5;
        minus(k, n) -= 1e-5;
        EXPECT_NEAR(gradient(k, n), (scalar(plus) - scalar(minus)) / 2e-5, 1e-9)
            << "t " << t << " rate " << n << " axis " << k;
      }
    }
  }
}

// A value that neighbouring rates follow moves each of them: its derivative is the sum of theirs.
TEST(RotationChain, GradientByValuesIsTheSumOverTheirRates) {
  const Chain c = RandomChain(5, 8);
  const std::vector<int> value_of = {0, 0, 0, 1, 2, 2, 2, 3};
  const RotationChain by_rates(c.times, c.rates), by_values(c.times, c.rates, value_of);
  ASSERT_EQ(by_rates.num_values(), 8);
  ASSERT_EQ(by_values.num_values(), 4);
  const Vector3d by_phi(1.0, -2.0, 0.5), by_omega(0.1, 0.4, -0.3);
  // Before the first rate, within values, on their borders, after the last rate.
  for (const double t :
       {c.times[0] - 0.004, c.times[1], c.times[1] + 0.001, c.times[2] + 0.001, c.times[3],
        c.times[4], c.times[5] + 0.001, c.times[6] + 0.001, c.times[7], c.times[7] + 0.005}) {
    const auto state = by_values.At(t);
    EXPECT_EQ(state.R_ref_gyro, by_rates.At(t).R_ref_gyro);
    Matrix3Xd of_rates = Matrix3Xd::Zero(3, 8), of_values = Matrix3Xd::Zero(3, 4);
    by_rates.AddRateGradient(state, by_phi, by_omega, of_rates);
    by_values.AddRateGradient(state, by_phi, by_omega, of_values);
    Matrix3Xd sums = Matrix3Xd::Zero(3, 4);
    for (int i = 0; i < 8; ++i) sums.col(value_of[static_cast<size_t>(i)]) += of_rates.col(i);
    EXPECT_LT((of_values - sums).norm(), 1e-12) << t;
  }
}

// A swing about one axis, whose angle is known: straight lines between its samples lose
// (omega h)^2 / 12 of it, which is 2e-3 here, and straight lines between ChainRates next to
// nothing. Uneven samples too.
TEST(ChainRate, KeepsTheIntegralOfACurve) {
  const double omega = 2.0 * M_PI * 5.0;
  for (const double jitter_s : {0.0, 0.001}) {
    Chain plain;
    plain.rates.resize(3, 61);
    for (int i = 0; i <= 60; ++i) {
      plain.times.push_back(0.005 * i + (i % 2 == 0 ? jitter_s : -jitter_s));
      plain.rates.col(i) = omega * std::cos(omega * plain.times.back()) * Vector3d::UnitX();
    }
    Chain better = plain;
    for (int i = 1; i < 60; ++i) {
      const auto at = static_cast<size_t>(i);
      better.rates.col(i) =
          ChainRate(plain.rates.col(i - 1), plain.rates.col(i), plain.rates.col(i + 1),
                    plain.times[at] - plain.times[at - 1], plain.times[at + 1] - plain.times[at]);
    }
    const auto angle_between = [&](const Chain& c, double from, double to) {
      const RotationChain chain(c.times, c.rates);
      const Matrix3d R = chain.At(from).R_ref_gyro.transpose() * chain.At(to).R_ref_gyro;
      return Log(Eigen::Quaterniond(R)).x();
    };
    // From a trough to a crest, a turn of 2 rad in all, between samples.
    const double truth = std::sin(omega * 0.0502) - std::sin(omega * 0.1498);
    const double lost = angle_between(plain, 0.1498, 0.0502) / truth - 1.0;
    const double left = angle_between(better, 0.1498, 0.0502) / truth - 1.0;
    EXPECT_LT(lost, -0.9 * omega * omega * 0.005 * 0.005 / 12.0);
    EXPECT_LT(std::abs(left), jitter_s > 0.0 ? 3e-4 : 5e-5);
  }
}

}  // namespace
}  // namespace camgyro
