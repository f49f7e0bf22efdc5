#include "core/sphere.h"

#include <gtest/gtest.h>

namespace camgyro {
namespace {

using Eigen::Vector3d;

TEST(TangentsOf, AreRightHandedWithTheirDirection) {
  for (const Vector3d& direction :
       {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1), Vector3d(0, 0, -1),
        Vector3d(-0.3, 0.8, 0.1), Vector3d(1e-9, -1e-9, 1)}) {
    const Vector3d unit = direction.normalized();
    Eigen::Matrix3d basis;
    basis << TangentsOf(unit), unit;
    EXPECT_NEAR((basis.transpose() * basis - Eigen::Matrix3d::Identity()).norm(), 0.0, 1e-14);
    EXPECT_NEAR(basis.determinant(), 1.0, 1e-14);
  }
}

}  // namespace
}  // namespace camgyro
