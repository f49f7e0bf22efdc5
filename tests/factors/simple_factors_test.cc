#include <gmock/gmock.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/effects/catalogue.h"
#include "core/pair_model.h"
#include "factors/bias_walk.h"
#include "factors/gyro_rate.h"
#include "tests/factors/difference_check.h"

namespace camgyro {
namespace {

// Measured = true + bias + noise: at the truth the residual is minus the noise, in sigmas.
TEST(GyroRate, ResidualIsMinusTheNoiseInSigmas) {
  const Eigen::Vector3d bias(0.01, -0.02, 0.03), noise(0.003, -0.006, -0.006);
  Eigen::Matrix3Xd truth(3, 2);
  truth << 1, 2, 3, 4, 5, 6;
  Eigen::Matrix3Xd measured = truth.colwise() + bias;
  measured.col(1) += noise;
  const GyroRate factor(measured, {0.003, 0.003, 0.006});
  Eigen::Matrix<double, 6, 1> r = Eigen::Matrix<double, 6, 1>::Constant(std::nan(""));
  const double* parameters[] = {truth.data(), bias.data()};
  ASSERT_TRUE(factor.Evaluate(parameters, r.data(), nullptr));
  EXPECT_LT((r - (Eigen::Matrix<double, 6, 1>() << 0, 0, 0, -1, 2, 1).finished()).norm(), 1e-10);
  Eigen::Vector3d b = bias;
  ExpectJacobiansMatchDifferences(factor, {truth.data(), b.data()}, 1e-6);
}

// Density 0.002 rad/s/sqrt(s) over 4 s: one sigma is 0.004 rad/s.
TEST(BiasWalk, ResidualIsTheStepInSigmas) {
  const BiasWalk factor(0.002, 4.0);
  Eigen::Vector3d b0(0.1, 0.2, 0.3), b1(0.104, 0.2, 0.292), r;
  const double* parameters[] = {b0.data(), b1.data()};
  ASSERT_TRUE(factor.Evaluate(parameters, r.data(), nullptr));
  EXPECT_LT((r - Eigen::Vector3d(1, 0, -2)).norm(), 1e-10);
  ExpectJacobiansMatchDifferences(factor, {b0.data(), b1.data()}, 1e-6);
}

// A mean of four samples has half the noise.
TEST(GyroRate, ReadingsMayBeMeansOfSamples) {
  Eigen::Matrix3Xd rates = Eigen::Matrix3Xd::Zero(3, 2);
  Eigen::Vector3d bias(0.003, 0.0, 0.0);
  const GyroRate factor(Eigen::Matrix3Xd::Zero(3, 2), {4, 1}, {0.003, 0.003, 0.003});
  Eigen::Matrix<double, 6, 1> r;
  const double* parameters[] = {rates.data(), bias.data()};
  ASSERT_TRUE(factor.Evaluate(parameters, r.data(), nullptr));
  EXPECT_LT((r - (Eigen::Matrix<double, 6, 1>() << 2, 0, 0, 1, 0, 0).finished()).norm(), 1e-10);
  ExpectJacobiansMatchDifferences(factor, {rates.data(), bias.data()}, 1e-6);
}

// Three samples with one correction, and one by itself, of a gyro that reads 2 % too much about x.
TEST(GyroRate, MeansOfSamplesHaveTheMeanOfTheEffects) {
  const auto effects = MakeEffects("gyro_scale", EffectSetup());
  ASSERT_TRUE(effects);
  const auto set = std::make_shared<const EffectSet>(*effects);
  Eigen::Matrix3Xd base(3, 4);
  base << 1.0, 2.0, 3.0, 4.0, 0.5, 0.5, 0.5, 0.5, -1.0, -1.0, -1.0, -1.0;
  Eigen::Matrix3Xd corrections(3, 2);
  corrections << 0.1, -0.2, 0.0, 0.0, 0.0, 0.0;
  // What the samples read beyond their base: correction, bias, and what the effect adds to the
  // rate.
  Eigen::Vector3d bias(0.003, 0.0, 0.0), scale(0.02, 0.0, 0.0);
  Eigen::Matrix3Xd measured(3, 2);
  measured << 0.1 + 0.003 + 0.02 * 2.1, -0.2 + 0.003 + 0.02 * 3.8, 0.0, 0.0, 0.0, 0.0;
  const GyroRate factor(measured, {3, 1}, {0.003, 0.003, 0.003}, set, {0.0, 0.1, 0.2, 0.3}, base);
  Eigen::Matrix<double, 6, 1> r;
  const double* parameters[] = {corrections.data(), bias.data(), scale.data()};
  ASSERT_TRUE(factor.Evaluate(parameters, r.data(), nullptr));
  EXPECT_LT(r.norm(), 1e-10);
  ExpectJacobiansMatchDifferences(factor, {corrections.data(), bias.data(), scale.data()}, 1e-6);
}

// What TrueRate takes for the true rates fits without a residual, also with an effect that is not
// linear in its parameter.
TEST(GyroRate, AgreesWithTheTrueRates) {
  auto gyro = std::make_shared<SensorSamples>();
  gyro->values.resize(3, 41);
  std::vector<double> times_s;
  for (Eigen::Index i = 0; i < gyro->values.cols(); ++i) {
    times_s.push_back(0.005 * static_cast<double>(i));
    const double phase = 25.0 * times_s.back();
    gyro->values.col(i) << std::sin(phase), std::cos(phase), std::sin(phase + 1.0);
  }
  gyro->times_s = times_s;
  EffectSetup setup;
  setup.gyro = gyro;
  const auto effects = MakeEffects("gyro_lowpass", setup);
  ASSERT_TRUE(effects);
  const auto set = std::make_shared<const EffectSet>(*effects);
  double value = 0.012 * 0.012;
  const Eigen::Matrix3Xd measured = gyro->values.middleCols(18, 4);
  const std::vector<double> four(times_s.begin() + 18, times_s.begin() + 22);
  Eigen::Vector3d bias(0.003, -0.002, 0.001);
  Eigen::Matrix3Xd rates(3, 4);
  for (int i = 0; i < 4; ++i) {
    rates.col(i) =
        TrueRate({set.get(), &value}, four[static_cast<size_t>(i)], measured.col(i) - bias);
  }
  const double* parameters[] = {rates.data(), bias.data(), &value};
  Eigen::Matrix<double, 12, 1> r;
  const GyroRate each(measured, {0.003, 0.003, 0.003}, set, four);
  ASSERT_TRUE(each.Evaluate(parameters, r.data(), nullptr));
  EXPECT_LT(r.norm(), 1e-9);
  ExpectJacobiansMatchDifferences(each, {rates.data(), bias.data(), &value}, 1e-7);
  // Of the mean of all, about those rates.
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();
  const GyroRate mean((measured - rates).rowwise().mean(), {4}, {0.003, 0.003, 0.003}, set, four,
                      rates);
  const double* of_mean[] = {correction.data(), bias.data(), &value};
  ASSERT_TRUE(mean.Evaluate(of_mean, r.data(), nullptr));
  EXPECT_LT(r.head<3>().norm(), 1e-9);
}

}  // namespace
}  // namespace camgyro
