#include "core/standard_distortion.h"

#include <gmock/gmock.h>

namespace camgyro {
namespace {

// A pinhole with kb says the same as the Kannala-Brandt lens that is reported for it.
TEST(StandardDistortion, KeepsTheRays) {
  LensParameters lens = MakePinhole(420.0, {375.5, 239.5});
  lens.tail<4>() << -0.31, -0.1, -0.06, -0.02;  // nearly equidistant
  lens[kK1] = 0.01;
  const Eigen::Vector2d size_px(752.0, 480.0);
  const DistortionCoefficients standard = StandardDistortion(DistortionModel::kNone, lens, size_px);
  ASSERT_EQ(standard.model, DistortionModel::kKannalaBrandt);
  LensParameters reported = MakePinhole(420.0, {375.5, 239.5});
  reported.segment<4>(kKb1) = standard.k;
  for (double u = 0.0; u <= 752.0; u += 94.0) {
    for (double v = 0.0; v <= 480.0; v += 96.0) {
      RayJet ray;
      ASSERT_TRUE(GetLens(DistortionModel::kNone).Unproject({u, v}, lens, &ray));
      const auto px = GetLens(standard.model).Project(ray.ray, reported);
      ASSERT_TRUE(px.has_value());
      EXPECT_LT((*px - Eigen::Vector2d(u, v)).norm(), 0.1) << u << " " << v;  // at the corners
    }
  }
  // Derivative, but for the picture's widest angle, which moves a little.
  LensParameters moved = lens;
  moved[kKb2] += 0.01;
  const Eigen::Vector4d change =
      StandardDistortion(DistortionModel::kNone, moved, size_px).k - standard.k;
  EXPECT_LT((change - 0.01 * standard.by_lens.col(kKb2)).norm(), 0.5 * change.norm());
}

}  // namespace
}  // namespace camgyro
