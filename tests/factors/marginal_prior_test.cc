#include "factors/marginal_prior.h"

#include <ceres/sphere_manifold.h>
#include <gmock/gmock.h>

#include <random>

#include "core/so3.h"
#include "tests/factors/difference_check.h"

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(MarginalPrior, ResidualIsLinearInTheTangentDifference) {
  const Quaterniond q_lin = Exp(Vector3d(0.3, 0.1, -0.5));
  MatrixXd S = MatrixXd::Zero(2, 5);
  S << 1, 2, 3, 4, 5, 0, 1, 0, -1, 0;
  const MarginalPrior prior(
      {{(VectorXd(2) << 7, 8).finished()}, {q_lin.coeffs(), MarginalPrior::Kind::kRotation}}, S,
      (VectorXd(2) << 0.5, -0.25).finished());
  const Eigen::Vector2d x(7.1, 8.0);
  const Quaterniond q = q_lin * Exp(Vector3d(0.2, 0, -0.1));
  Eigen::Vector2d r;
  const double* parameters[] = {x.data(), q.coeffs().data()};
  ASSERT_TRUE(prior.Evaluate(parameters, r.data(), nullptr));
  // delta = (0.1, 0, 0.2, 0, -0.1)
  EXPECT_NEAR(r[0], 0.1 + 3 * 0.2 - 5 * 0.1 + 0.5, 1e-12);
  EXPECT_NEAR(r[1], 0.0 - 0.0 - 0.25, 1e-12);
}

// Half a radian away from the linearisation, where dropping the inverse right Jacobian costs 20 %.
TEST(MarginalPrior, JacobianMatchesDifferencesFarFromTheLinearisation) {
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    const Quaterniond q_lin =
        Exp(Vector3d{normal(generator), normal(generator), normal(generator)});
    MatrixXd S(4, 5);
    for (int i = 0; i < S.size(); ++i) S.data()[i] = normal(generator);
    const MarginalPrior prior(
        {{VectorXd::Zero(2)}, {q_lin.coeffs(), MarginalPrior::Kind::kRotation}}, S,
        VectorXd::Ones(4));
    Eigen::Vector2d x(0.3, -0.4);
    Quaterniond q = q_lin * Exp(Vector3d(0.3, -0.3, 0.25));
    ExpectJacobiansMatchDifferences(prior, {x.data(), q.coeffs().data()}, 1e-7);
  }
}

// Near the linearisation a point's residual is the tangent that Ceres steps in, at any length of
// the homogeneous vector; far from it the derivatives still hold, and behind it there is none.
TEST(MarginalPrior, TakesAHomogeneousPointInTheTangentOfItsSphere) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> normal;
  const ceres::SphereManifold<4> sphere;
  const auto random_vector = [&](int size) {
    return VectorXd(VectorXd::NullaryExpr(size, [&] { return normal(generator); }));
  };
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector4d at = random_vector(4).normalized();
    const MarginalPrior prior({{at, MarginalPrior::Kind::kHomogeneousPoint}},
                              MatrixXd::Identity(3, 3), VectorXd::Zero(3));
    const Vector3d step = 1e-4 * random_vector(3);
    Eigen::Vector4d x;
    ASSERT_TRUE(sphere.Plus(at.data(), step.data(), x.data()));
    x *= 2.5;
    Vector3d r;
    const double* parameters[] = {x.data()};
    ASSERT_TRUE(prior.Evaluate(parameters, r.data(), nullptr));
    EXPECT_LT((r - step).norm(), 1e-6 * step.norm());

    Eigen::Vector4d far = at + 0.3 * random_vector(4).normalized();
    ExpectJacobiansMatchDifferences(prior, {far.data()}, 1e-7, {far.data()});
    const Eigen::Vector4d behind = -at;
    const double* beyond[] = {behind.data()};
    EXPECT_FALSE(prior.Evaluate(beyond, r.data(), nullptr));
  }
}

}  // namespace
}  // namespace camgyro
