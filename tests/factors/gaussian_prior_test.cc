#include "factors/gaussian_prior.h"

#include <gmock/gmock.h>

#include <limits>

#include "core/so3.h"
#include "tests/factors/difference_check.h"

namespace camgyro {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Two blocks, the second coordinate of the first one unknown.
GaussianPrior MakePrior(const Quaterniond& q_mean) {
  return GaussianPrior(
      {{Vector2d(7.0, 8.0), Vector2d(0.5, std::numeric_limits<double>::infinity())},
       {q_mean.coeffs(), Vector3d(0.1, 0.2, 0.4), true}});
}

TEST(GaussianPrior, ResidualIsTheTangentDifferenceInSigmas) {
  const Quaterniond q_mean = Exp(Vector3d(0.3, 0.1, -0.5));
  const Vector2d x(8.0, 1e3);
  const Quaterniond q = q_mean * Exp(Vector3d(0.1, -0.2, 0.2));
  const double* parameters[] = {x.data(), q.coeffs().data()};
  Eigen::Matrix<double, 5, 1> r, expected;
  ASSERT_TRUE(MakePrior(q_mean).Evaluate(parameters, r.data(), nullptr));
  expected << 2.0, 0.0, 1.0, -1.0, 0.5;
  EXPECT_LT((r - expected).norm(), 1e-12) << r.transpose();
}

// Half a radian away from the mean, where dropping the inverse right Jacobian costs 20 %.
TEST(GaussianPrior, JacobianMatchesDifferencesFarFromTheMean) {
  const Quaterniond q_mean = Exp(Vector3d(-0.7, 0.4, 1.1));
  Vector2d x(6.0, 9.0);
  Quaterniond q = q_mean * Exp(Vector3d(0.3, -0.3, 0.25));
  ExpectJacobiansMatchDifferences(MakePrior(q_mean), {x.data(), q.coeffs().data()}, 1e-7);
}

}  // namespace
}  // namespace camgyro
