#include "core/lens.h"

#include <gmock/gmock.h>

#include <random>

namespace camgyro {
namespace {

LensParameters EurocLens() {
  LensParameters lens = MakePinhole(457.296, {367.215, 248.375}, 458.654 / 457.296);
  lens.segment<4>(kK1) << -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05;
  return lens;
}

TEST(Lens, PinholeByHand) {
  const LensParameters lens = MakePinhole(500.0, {320.0, 240.0}, 1.1);
  RayJet jet;
  ASSERT_TRUE(GetLens(DistortionModel::kNone).Unproject({320.0 + 55.0, 240.0 - 25.0}, lens, &jet));
  EXPECT_LT((jet.ray - Eigen::Vector3d(0.1, -0.05, 1.0)).norm(), 1e-15);
}

// By hand with OpenCV's formula: x = 0.3, y = -0.2, r2 = 0.13.
TEST(Lens, RadTanFollowsTheFormulaOfOpenCv) {
  LensParameters lens = MakePinhole(100.0, {0.0, 0.0});
  lens.segment<4>(kK1) << -0.1, 0.02, 0.003, -0.004;
  const double radial = 1 - 0.1 * 0.13 + 0.02 * 0.0169;
  const double u = 0.3 * radial + 2 * 0.003 * 0.3 * -0.2 - 0.004 * (0.13 + 2 * 0.09);
  const double v = -0.2 * radial + 0.003 * (0.13 + 2 * 0.04) + 2 * -0.004 * 0.3 * -0.2;
  const auto px = GetLens(DistortionModel::kRadTan).Project({0.6, -0.4, 2.0}, lens);
  ASSERT_TRUE(px.has_value());
  EXPECT_NEAR(px->x(), 100 * u, 1e-12);
  EXPECT_NEAR(px->y(), 100 * v, 1e-12);
}

TEST(Lens, ProjectInvertsUnprojectOverTheWholePicture) {
  const Lens& model = GetLens(DistortionModel::kRadTan);
  const LensParameters lens = EurocLens();
  for (double u = 0; u <= 752; u += 47) {
    for (double v = 0; v <= 480; v += 40) {
      RayJet jet;
      ASSERT_TRUE(model.Unproject({u, v}, lens, &jet));
      const auto px = model.Project(2.5 * jet.ray, lens);
      ASSERT_TRUE(px.has_value());
      EXPECT_LT((*px - Eigen::Vector2d(u, v)).norm(), 1e-9);
    }
  }
}

// An equidistant lens of 66 deg half the diagonal.
LensParameters FisheyeLens() {
  LensParameters lens = MakePinhole(380.0, {374.0, 242.0}, 1.01);
  lens.tail<4>() << 0.02, -0.01, 0.006, -0.002;
  return lens;
}

void ExpectDerivativesOfDifferences(const Lens& model, const LensParameters& lens) {
  std::mt19937_64 generator(4);
  std::uniform_real_distribution<double> u(0, 752), v(0, 480);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector2d px(u(generator), v(generator));
    RayJet jet;
    ASSERT_TRUE(model.Unproject(px, lens, &jet));
    for (int k = 0; k < 2; ++k) {
      RayJet plus, minus;
      const Eigen::Vector2d h = 1e-3 * Eigen::Vector2d::Unit(k);
      ASSERT_TRUE(model.Unproject(px + h, lens, &plus) && model.Unproject(px - h, lens, &minus));
      EXPECT_LT(((plus.ray - minus.ray) / 2e-3 - jet.J_ray_px.col(k)).norm(), 1e-9);
    }
    for (int k = 0; k < kLensSize; ++k) {
      const double h = k < kAspect ? 1e-3 : 1e-6;
      LensParameters lens_plus = lens, lens_minus = lens;
      lens_plus[k] += h;
      lens_minus[k] -= h;
      RayJet plus, minus;
      ASSERT_TRUE(model.Unproject(px, lens_plus, &plus) && model.Unproject(px, lens_minus, &minus));
      const double scale = 1.0 + jet.J_ray_lens.col(k).norm();
      EXPECT_LT(((plus.ray - minus.ray) / (2 * h) - jet.J_ray_lens.col(k)).norm(), 1e-7 * scale)
          << k;
      EXPECT_LT(((plus.J_ray_px - minus.J_ray_px) / (2 * h) - jet.J_ray_px_lens[k]).norm(),
                1e-7 * scale)
          << k;
    }
  }
}

TEST(Lens, DerivativesMatchDifferences) {
  LensParameters lens = EurocLens();
  lens[kP1] = 0.004;  // large enough that a wrong tangential term would show
  lens[kP2] = -0.003;
  ExpectDerivativesOfDifferences(GetLens(DistortionModel::kRadTan), lens);
  lens.tail<4>() << -0.05, 0.03, 0.02, -0.01;
  ExpectDerivativesOfDifferences(GetLens(DistortionModel::kRadTan), lens);
  ExpectDerivativesOfDifferences(GetLens(DistortionModel::kKannalaBrandt), FisheyeLens());
}

// Without distortion, less is computed where fewer derivatives are asked for.
TEST(Lens, FewerDerivativesAreTheSameOnes) {
  const LensParameters pinhole = MakePinhole(500.0, {320.0, 240.0}, 1.1);
  for (const LensParameters& lens : {pinhole, EurocLens()}) {
    const Lens& model = GetLens(DistortionModel::kRadTan);
    const Eigen::Vector2d px(401.0, 77.0);
    RayJet all, most, some, none;
    ASSERT_TRUE(model.Unproject(px, lens, &all));
    ASSERT_TRUE(model.Unproject(px, lens, &most, LensDerivatives::kRadTan));
    ASSERT_TRUE(model.Unproject(px, lens, &some, LensDerivatives::kPinhole));
    ASSERT_TRUE(model.Unproject(px, lens, &none, LensDerivatives::kNone));
    EXPECT_EQ(none.num_lens, 0);
    ASSERT_EQ(some.num_lens, 3);
    EXPECT_EQ(some.ray, all.ray);
    EXPECT_EQ(none.ray, all.ray);
    EXPECT_EQ(some.J_ray_px, all.J_ray_px);
    EXPECT_EQ(none.J_ray_px, all.J_ray_px);
    ASSERT_EQ(most.num_lens, 8);
    EXPECT_EQ(most.ray, all.ray);
    EXPECT_EQ(most.J_ray_px, all.J_ray_px);
    for (int k = 0; k < 8; ++k) {
      EXPECT_EQ(most.J_ray_lens.col(k), all.J_ray_lens.col(k)) << k;
      EXPECT_EQ(most.J_ray_px_lens[k], all.J_ray_px_lens[k]) << k;
    }
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(some.J_ray_lens.col(k), all.J_ray_lens.col(k)) << k;
      EXPECT_EQ(some.J_ray_px_lens[k], all.J_ray_px_lens[k]) << k;
    }
  }
}

TEST(Lens, RefusesPixelsBeyondTheFoldOfTheDistortion) {
  LensParameters lens = MakePinhole(300.0, {320.0, 240.0});
  lens[kK1] = -0.4;  // r (1 - 0.4 r^2) has its maximum 0.61 at r = 0.91
  RayJet jet;
  EXPECT_TRUE(GetLens(DistortionModel::kRadTan).Unproject({320.0 + 150.0, 240.0}, lens, &jet));
  EXPECT_FALSE(GetLens(DistortionModel::kRadTan).Unproject({320.0 + 250.0, 240.0}, lens, &jet));
}

TEST(Lens, PointsBehindTheCameraHaveNoPixel) {
  EXPECT_FALSE(GetLens(DistortionModel::kNone)
                   .Project({0.1, 0.1, -1.0}, MakePinhole(300.0, {320.0, 240.0}))
                   .has_value());
}

}  // namespace
}  // namespace camgyro
