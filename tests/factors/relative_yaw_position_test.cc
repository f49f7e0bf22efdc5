#include "factors/relative_yaw_position.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tests/factors/difference_check.h"

namespace camgyro {
namespace {

using Eigen::Vector4d;

Vector4d Residual(const ceres::CostFunction& factor, const Vector4d& a, const Vector4d& b) {
  const double* parameters[] = {a.data(), b.data()};
  Vector4d r = Vector4d::Constant(std::nan(""));
  EXPECT_TRUE(factor.Evaluate(parameters, r.data(), nullptr));
  return r;
}

// From (1, 2, 3), looking along y, one goes 4 m ahead, 1 m to the left and 2 m up and turns to the
// left by 0.3 rad.
TEST(RelativeYawPosition, ResidualIsTheErrorInSigmas) {
  RelativeYawPosition measured;
  measured.p_a_b_m = {4.0, 1.0, 2.0};
  measured.yaw_a_b_rad = 0.3;
  measured.covariance = Vector4d(0.01, 0.04, 0.09, 1e-4).asDiagonal();
  const auto factor = MakeRelativeYawPosition(measured);
  const Vector4d a(1.0, 2.0, 3.0, M_PI_2);
  const Vector4d b(0.0, 6.0, 5.0, M_PI_2 + 0.3);
  EXPECT_LT(Residual(*factor, a, b).norm(), 1e-12);
  // Too far along y by 0.2 m: ahead by two sigmas. Too far along x by 0.2 m: to the right by one.
  EXPECT_LT((Residual(*factor, a, b + Vector4d(0.0, 0.2, 0.0, 0.0)) - Vector4d(2, 0, 0, 0)).norm(),
            1e-9);
  EXPECT_LT(
      (Residual(*factor, a, b + Vector4d(0.2, 0.0, 0.3, 0.03)) - Vector4d(0, -1, 1, 3)).norm(),
      1e-9);
  // Whole turns are no error.
  EXPECT_LT(Residual(*factor, a, b + Vector4d(0.0, 0.0, 0.0, -4.0 * M_PI)).norm(), 1e-9);
}

// r' r = e' C^-1 e with a full covariance.
TEST(RelativeYawPosition, IsWhitenedWithTheWholeCovariance) {
  Eigen::Matrix4d root;
  root << 0.1, 0.0, 0.0, 0.0, 0.05, 0.2, 0.0, 0.0, -0.02, 0.1, 0.3, 0.0, 0.01, 0.0, 0.02, 0.05;
  RelativeYawPosition measured;
  measured.covariance = root * root.transpose();
  const Vector4d e(0.3, -0.1, 0.2, 0.04);
  const Vector4d r = Residual(*MakeRelativeYawPosition(measured), Vector4d::Zero(), e);
  EXPECT_NEAR(r.squaredNorm(), e.dot(measured.covariance.inverse() * e), 1e-9);
}

TEST(RelativeYawPosition, JacobiansMatchDifferences) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 20; ++i) {
    RelativeYawPosition measured;
    measured.p_a_b_m = {normal(random), normal(random), normal(random)};
    measured.yaw_a_b_rad = normal(random);
    measured.covariance = Vector4d(0.04, 0.01, 0.09, 1e-3).asDiagonal();
    measured.covariance(0, 3) = measured.covariance(3, 0) = 2e-3;
    Vector4d a{normal(random), normal(random), normal(random), normal(random)};
    Vector4d b{normal(random), normal(random), normal(random), normal(random)};
    b[3] = a[3] + measured.yaw_a_b_rad + 0.5 * std::tanh(b[3]);  // away from the step at pi
    ExpectJacobiansMatchDifferences(*MakeRelativeYawPosition(measured), {a.data(), b.data()}, 1e-6,
                                    {a.data(), b.data()});
  }
}

}  // namespace
}  // namespace camgyro
