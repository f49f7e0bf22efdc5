#include "core/so3.h"

#include <gmock/gmock.h>

#include <random>

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Vector3d RandomVector(std::mt19937_64* generator, double scale) {
  std::normal_distribution<double> normal;
  return scale * Vector3d{normal(*generator), normal(*generator), normal(*generator)};
}

TEST(So3, ExpAgreesWithAngleAxisAtAllSizes) {
  std::mt19937_64 generator(1);
  for (const double scale : {0.0, 1e-12, 1e-6, 1e-4, 0.1, 1.0}) {
    const Vector3d phi = RandomVector(&generator, scale);
    const Matrix3d expected =
        phi.norm() > 0.0 ? Eigen::AngleAxisd(phi.norm(), phi.normalized()).toRotationMatrix()
                         : Matrix3d::Identity().eval();
    EXPECT_LT((Exp(phi).toRotationMatrix() - expected).norm(), 1e-14) << scale;
  }
}

TEST(So3, LogInvertsExpUpToPiAndTakesTheShortestArc) {
  std::mt19937_64 generator(2);
  for (const double angle : {0.0, 1e-10, 1e-7, 1e-6, 1e-3, 1.0, 3.0, 3.14159}) {
    const Vector3d phi = angle * RandomVector(&generator, 1.0).normalized();
    EXPECT_LT((Log(Exp(phi)) - phi).norm(), 1e-9) << angle;
    Quaterniond negated = Exp(phi);
    negated.coeffs() *= -1.0;
    EXPECT_LT((Log(negated) - phi).norm(), 1e-9) << angle;
  }
  const Vector3d long_way(0, 0, 2 * M_PI - 0.5);
  EXPECT_LT((Log(Exp(long_way)) - Vector3d(0, 0, -0.5)).norm(), 1e-12);
}

TEST(So3, JacobiansAreDerivativesOfExp) {
  std::mt19937_64 generator(3);
  for (const double scale : {1e-9, 1e-4, 1e-2, 0.5, 1.5}) {
    const Vector3d phi = RandomVector(&generator, scale);
    const Vector3d d = RandomVector(&generator, 1.0);
    const double h = 1e-6;
    // Central difference of Log(Exp(phi + s d) Exp(phi)^-1) at s = 0.
    const auto left = [&](double s) {
      return Log(Quaterniond(Exp(Vector3d(phi + s * d)) * Exp(phi).conjugate()));
    };
    const Vector3d numeric = (left(h) - left(-h)) / (2 * h);
    EXPECT_LT((LeftJacobian(phi) * d - numeric).norm(), 1e-8) << scale;
    EXPECT_LT((TurnAndLeftJacobian(phi).R - Exp(phi).toRotationMatrix()).norm(), 1e-14) << scale;
    EXPECT_LT((Exp(phi).toRotationMatrix() * RightJacobian(phi) - LeftJacobian(phi)).norm(), 1e-12)
        << scale;
    EXPECT_LT((LeftJacobian(phi) * LeftJacobianInverse(phi) - Matrix3d::Identity()).norm(), 1e-11)
        << scale;
    EXPECT_LT((RightJacobian(phi) * RightJacobianInverse(phi) - Matrix3d::Identity()).norm(), 1e-11)
        << scale;
  }
}

}  // namespace
}  // namespace camgyro
