#include "factors/relative_rotation.h"

#include <gmock/gmock.h>

#include <random>

#include "core/pair_model.h"
#include "core/rotation_chain.h"
#include "core/so3.h"
#include "factors/rotation_manifold.h"
#include "tests/factors/difference_check.h"

namespace camgyro {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Scene {
  PairMeasurement measurement;
  ShutterParameters shutter;
  Quaterniond q_gyro_cam;
  std::vector<Eigen::Matrix3Xd> groups;
  Eigen::Vector2d times_s = Eigen::Vector2d::Zero();  // of the frames from their stamps

  std::vector<double*> Parameters() {
    std::vector<double*> p = {shutter.data(), q_gyro_cam.coeffs().data()};
    if (measurement.own_times) {
      p.push_back(&times_s[0]);
      p.push_back(&times_s[1]);
    }
    for (auto& group : groups) p.push_back(group.data());
    return p;
  }
  Vector3d Residual() {
    Vector3d r = Vector3d::Constant(std::nan(""));
    EXPECT_TRUE(RelativeRotation(std::make_shared<PairMeasurement>(measurement))
                    .Evaluate(Parameters().data(), r.data(), nullptr));
    return r;
  }
};

Scene MakeScene(uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const auto random_vector = [&] {
    return Vector3d{normal(generator), normal(generator), normal(generator)};
  };
  Scene s;
  s.shutter << 0.02, 0.012;
  s.q_gyro_cam = Exp(random_vector());
  auto& m = s.measurement;
  m.frame_a.stamp_s = 0.02;
  m.frame_b.stamp_s = 0.09;
  m.row_fraction = 0.5;
  m.sigma = 0.002;
  m.rate_group_sizes = {5, 8};
  Eigen::Matrix3Xd rates(3, 13);
  for (int i = 0; i < 13; ++i) {
    m.rate_times_s.push_back(0.01 * i);
    rates.col(i) = random_vector();
  }
  s.groups = {rates.leftCols(5), rates.rightCols(8)};
  const RotationChain chain(m.rate_times_s, rates);
  const Eigen::Matrix3d R_c = s.q_gyro_cam.toRotationMatrix();
  const double shift = 0.012 + 0.5 * 0.02;
  m.q_a_b = Quaterniond((chain.At(m.frame_a.stamp_s + shift).R_ref_gyro * R_c).transpose() *
                        chain.At(m.frame_b.stamp_s + shift).R_ref_gyro * R_c);
  return s;
}

TEST(RelativeRotation, ResidualIsTheErrorInSigmas) {
  Scene s = MakeScene(1);
  EXPECT_LT(s.Residual().norm(), 1e-9);
  // Turn the second camera by two sigma about the gyro's z axis.
  const Vector3d turn_gyro_rad(0, 0, 2 * s.measurement.sigma);
  s.measurement.q_a_b =
      s.measurement.q_a_b * Exp(Vector3d(s.q_gyro_cam.conjugate() * turn_gyro_rad));
  EXPECT_LT((s.Residual() - Vector3d(0, 0, 2)).norm(), 1e-9);
}

TEST(RelativeRotation, JacobianMatchesDifferences) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    Scene s = MakeScene(seed);
    s.shutter[kDelay] += 0.0013;
    s.q_gyro_cam = s.q_gyro_cam * Exp(Vector3d(0.1, -0.2, 0.15));
    const RelativeRotation factor(std::make_shared<PairMeasurement>(s.measurement));
    ExpectJacobiansMatchDifferences(factor, s.Parameters(), 1e-7);
  }
}

// An offset of a frame's time is an error of its stamp, which makes up for the other one.
TEST(RelativeRotation, TakesTheFramesOwnTimes) {
  for (uint64_t seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE(seed);
    Scene s = MakeScene(seed);
    s.measurement.own_times = true;
    s.measurement.frame_a.stamp_s += 0.002;
    s.measurement.frame_b.stamp_s -= 0.003;
    EXPECT_GT(s.Residual().norm(), 0.1);
    s.times_s << -0.002, 0.003;
    EXPECT_LT(s.Residual().norm(), 1e-9);
    s.times_s << 0.001, -0.004;
    const RelativeRotation factor(std::make_shared<PairMeasurement>(s.measurement));
    ExpectJacobiansMatchDifferences(factor, s.Parameters(), 1e-7);
  }
}

}  // namespace
}  // namespace camgyro
