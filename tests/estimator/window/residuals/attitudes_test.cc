// Rotations between attitudes of a camera, which have neither pixels nor a lens.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/rotation_chain.h"
#include "estimator/window/refinement.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

// Attitudes of a turning camera from the gyro's own readings, with an error of this size [rad].
EstimationInput AttitudesThatFollowTheGyro(const Calibration& truth, double error_rad) {
  constexpr double kIntervalS = 0.01;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  const auto noise = [&](double sigma) {
    const double x = normal(generator), y = normal(generator);
    return Eigen::Vector3d(sigma * Eigen::Vector3d(x, y, normal(generator)));
  };
  EstimationInput input;
  std::vector<double> times;
  for (int i = 0; i < 1300; ++i) {
    const double t = kIntervalS * i;
    const Eigen::Vector3d rate(std::sin(5.0 * t), 0.8 * std::cos(3.0 * t), std::sin(1.7 * t));
    input.rates.push_back({t, rate + truth.bias_gyro_rad_s + noise(0.003), false});
    times.push_back(t);
  }
  Eigen::Matrix3Xd rates(3, static_cast<Eigen::Index>(times.size()));
  for (size_t i = 0; i < times.size(); ++i) {
    const auto& now = input.rates[i].omega_gyro_rad_s;
    const auto& before = input.rates[i == 0 ? 0 : i - 1].omega_gyro_rad_s;
    const auto& after = input.rates[std::min(i + 1, times.size() - 1)].omega_gyro_rad_s;
    rates.col(static_cast<Eigen::Index>(i)) =
        ChainRate(before, now, after, kIntervalS, kIntervalS) - truth.bias_gyro_rad_s;
  }
  const RotationChain chain(times, rates);
  const Eigen::Matrix3d R_gyro_cam = truth.q_gyro_cam.toRotationMatrix();
  for (int i = 0; i < 600; ++i) {
    TimedPair pair;
    pair.id = pair.frame_a = i;
    pair.frame_b = i + 1;
    pair.time_a_s = 0.2 + i / 60.0;
    pair.time_b_s = 0.2 + (i + 1) / 60.0;
    const Eigen::Matrix3d R_a = chain.At(pair.time_a_s + truth.delay_s).R_ref_gyro * R_gyro_cam;
    const Eigen::Matrix3d R_b = chain.At(pair.time_b_s + truth.delay_s).R_ref_gyro * R_gyro_cam;
    pair.rotation.frame_a = pair.frame_a;
    pair.rotation.frame_b = pair.frame_b;
    pair.rotation.q_a_b = Eigen::Quaterniond(R_a.transpose() * R_b) * Exp(noise(error_rad));
    input.pairs.push_back(pair);
  }
  return input;
}

// A filter made the attitudes of this very gyro: residuals are far smaller than its noise, which
// must neither stop the fit nor make it sure of more than the readings tell.
TEST(Attitudes, ThatFollowTheGyroHaveHonestSigmas) {
  Calibration truth;
  truth.width_px = truth.height_px = 1;
  truth.delay_s = 0.021;
  truth.bias_gyro_rad_s << 0.01, -0.02, 0.005;
  truth.q_gyro_cam = Exp(Eigen::Vector3d(0.4, -1.1, 0.7));
  Prior prior{truth};
  prior.mean.lens = MakePinhole(1.0, {0.0, 0.0});
  prior.mean.delay_s += 0.004;
  prior.mean.q_gyro_cam = prior.mean.q_gyro_cam * Exp(Eigen::Vector3d(0.02, 0.03, -0.02));
  prior.mean.bias_gyro_rad_s.setZero();
  prior.sigma << 1.0, 1.0, 1.0, 1.0, 0.05, Eigen::Vector3d::Constant(0.1),
      Eigen::Vector3d::Constant(0.15);
  // The turn of the gyro's noise between two attitudes.
  const double gyro_rad = 0.003 * std::sqrt(0.01 / 60.0);
  for (const double error_rad : {0.0, 1e-6, 1e-4, 1e-3}) {
    SCOPED_TRACE(error_rad);
    const EstimationInput input = AttitudesThatFollowTheGyro(truth, error_rad);
    const Result<Refined> refined = Refine(input, input.pairs, prior.mean, prior, {});
    ASSERT_TRUE(refined.has_value()) << refined.error().message;
    EXPECT_TRUE(refined->converged);
    const Calibration& c = refined->calibration;
    const StateVector error = ErrorInSigmas(c, truth);
    EXPECT_LT(error.tail<7>().cwiseAbs().maxCoeff(), 4.0) << error.transpose();
    EXPECT_LT(c.sigma()[kStateDelay], 1e-3);
    EXPECT_LT(c.sigma().tail<6>().maxCoeff(), 1e-2);
    // The attitudes' own noise where it is the larger one, never less than a third of the gyro's.
    const double noise = refined->quality.noise_px;
    EXPECT_GE(noise, 0.333 * gyro_rad);
    EXPECT_LT(noise, std::max(0.34 * gyro_rad, 1.1 * error_rad));
    EXPECT_GT(noise, error_rad > gyro_rad ? 0.9 * error_rad : 0.0);
  }
}

}  // namespace
}  // namespace camgyro
