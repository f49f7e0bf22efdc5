#include "core/division_lens.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "core/lens.h"

namespace camgyro {
namespace {

const Eigen::Vector2d kSize(640.0, 480.0), kCentre(319.5, 239.5);

TEST(DivisionLens, LambdaIsHowFarItMovesTheFarthestCorner) {
  const DivisionLens barrel(-0.2, kCentre, kSize);
  const Eigen::Vector2d corner = kSize;
  EXPECT_NEAR(barrel.radius_px(), (corner - kCentre).norm(), 1e-9);
  const Eigen::Vector2d there = barrel.Undistorted(corner);
  EXPECT_NEAR((corner - kCentre).norm() / (there - kCentre).norm(), 0.8, 1e-12);
  EXPECT_NEAR((barrel.Undistorted(kCentre) - kCentre).norm(), 0.0, 1e-12);
}

TEST(DivisionLens, StretchIsTheRootOfTheAreas) {
  for (const double lambda : {-0.4, 0.3}) {
    const DivisionLens lens(lambda, kCentre, kSize);
    for (const Eigen::Vector2d& px :
         {Eigen::Vector2d(330.0, 250.0), Eigen::Vector2d(60.0, 400.0)}) {
      constexpr double kStep = 1e-4;
      Eigen::Matrix2d J;
      for (int i = 0; i < 2; ++i) {
        const Eigen::Vector2d d = kStep * Eigen::Vector2d::Unit(i);
        J.col(i) = (lens.Undistorted(px + d) - lens.Undistorted(px - d)) / (2.0 * kStep);
      }
      EXPECT_NEAR(lens.Stretch(px), std::sqrt(J.determinant()), 1e-6);
    }
  }
}

TEST(DivisionLens, HasNoRayWherePixelsComeNearerAgain) {
  const Eigen::Vector2d outside = kCentre + 1.6 * (kSize - kCentre);
  EXPECT_FALSE(DivisionLens(-0.5, kCentre, kSize).HasRay(outside));
  EXPECT_FALSE(DivisionLens(0.5, kCentre, kSize).HasRay(outside));
  EXPECT_TRUE(DivisionLens(-0.5, kCentre, kSize).HasRay(kSize));
}

// A ray whose pixel the division model tells, through a lens with these coefficients.
void ExpectSamePixels(double lambda, const LensParameters& lens, DistortionModel model,
                      double limit_px) {
  const DivisionLens division(lambda, kCentre, kSize);
  for (const Eigen::Vector2d& px :
       {Eigen::Vector2d(400.0, 250.0), Eigen::Vector2d(100.0, 380.0), Eigen::Vector2d(2.0, 3.0)}) {
    const Eigen::Vector2d pinhole = (division.Undistorted(px) - kCentre) / lens[kFocal];
    const auto seen = GetLens(model).Project(pinhole.homogeneous(), lens);
    ASSERT_TRUE(seen);
    EXPECT_LT((*seen - px).norm(), limit_px) << "lambda " << lambda << " at " << px.transpose();
  }
}

TEST(DivisionLens, IsNearlyThatOfOtherModels) {
  for (const double lambda : {-0.3, -0.1, 0.0, 0.1}) {
    LensParameters lens = MakePinhole(500.0, kCentre);
    const double edge_tan = DivisionLens(lambda, kCentre, kSize).radius_px() / lens[kFocal];
    lens.segment<2>(kK1) = RadTanLike(lambda, edge_tan);
    ExpectSamePixels(lambda, lens, DistortionModel::kRadTan, 3.0);
    lens = MakePinhole(500.0, kCentre);
    lens.segment<4>(kKb1) = KannalaBrandtLike(lambda, edge_tan);
    ExpectSamePixels(lambda, lens, DistortionModel::kNone, 0.3);
  }
  EXPECT_EQ(RadTanLike(0.0, 0.8).norm(), 0.0);
  EXPECT_EQ(KannalaBrandtLike(0.0, 0.8).norm(), 0.0);
}

}  // namespace
}  // namespace camgyro
