#include "factors/rotation_manifold.h"

#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>

#include <random>

namespace ceres {  // the macro below names ceres' matchers without their namespace
namespace {

TEST(RotationManifold, KeepsCeresInvariants) {
  camgyro::RotationManifold manifold;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    Eigen::Vector4d x, y;
    Eigen::Vector3d delta;
    for (int i = 0; i < 4; ++i) x[i] = normal(generator);
    for (int i = 0; i < 3; ++i) delta[i] = 0.5 * normal(generator);
    x.normalize();
    ASSERT_TRUE(manifold.Plus(x.data(), Eigen::Vector3d(0.3 * delta.reverse()).data(), y.data()));
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-9);
  }
}

TEST(RotationManifold, TangentIsTheFullAngleOnTheRight) {
  camgyro::RotationManifold manifold;
  const Eigen::Quaterniond x = camgyro::Exp(Eigen::Vector3d(0.4, -0.2, 0.9));
  const Eigen::Vector3d delta(0, 0, 0.5);
  Eigen::Quaterniond y;
  ASSERT_TRUE(manifold.Plus(x.coeffs().data(), delta.data(), y.coeffs().data()));
  const Eigen::Matrix3d expected =
      x.toRotationMatrix() * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_LT((y.toRotationMatrix() - expected).norm(), 1e-12);
}

TEST(RotationManifold, LiftSurvivesTheMultiplicationByPlusJacobian) {
  const Eigen::Quaterniond x = camgyro::Exp(Eigen::Vector3d(0.4, -0.2, 0.9));
  const Eigen::RowVector3d by_tangent(1.5, -2.0, 0.25);
  const Eigen::RowVector4d lifted = camgyro::RotationManifold::Lift(by_tangent, x.coeffs().data());
  const auto plus = camgyro::RotationManifold::PlusJacobianOf(x.coeffs().data());
  EXPECT_LT((lifted * plus - by_tangent).norm(), 1e-12);
}

}  // namespace
}  // namespace ceres
