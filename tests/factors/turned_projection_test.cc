#include "factors/turned_projection.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tests/factors/difference_check.h"

namespace camgyro {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

// A camera that looks along x of a world with z up: x_cam = -y, y_cam = -z, z_cam = x.
Eigen::Quaterniond AlongX() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::Quaterniond(R);
}

RayJet RayOf(const Vector2d& px) {
  RayJet jet;
  const LensParameters lens = MakePinhole(500.0, {320.0, 240.0}, 1.02);
  EXPECT_TRUE(GetLens(DistortionModel::kNone).Unproject(px, lens, &jet, LensDerivatives::kNone));
  return jet;
}

// A point 10 m ahead and 1 m to the left of the pivot; the camera is 2 m behind the pivot. After a
// quarter turn to the left and 1 m ahead it is 1 + 2 - 1 m ahead of the camera, 10 m to its left.
TEST(TurnedProjection, ResidualIsTheErrorInSigmas) {
  TurnedProjection seen;
  seen.pivot_m = {5.0, 6.0, 7.0};
  seen.point_m = seen.pivot_m + Vector3d(10.0, 1.0, 0.5);
  seen.p_cam_m = seen.pivot_m - Vector3d(2.0, 0.0, 0.0);
  seen.q_world_cam = AlongX();
  seen.sigma_px = 0.5;
  // Without turn and shift the point is at (-1, -0.5, 12) of the camera.
  const Vector2d px(320.0 - 510.0 / 12.0, 240.0 - 250.0 / 12.0);
  seen.ray = RayOf(px + Vector2d(1.0, -0.5));
  Vector4d none = Vector4d::Zero();
  Vector2d r = Vector2d::Constant(std::nan(""));
  const double* parameters[] = {none.data()};
  ASSERT_TRUE(MakeTurnedProjection(seen)->Evaluate(parameters, r.data(), nullptr));
  EXPECT_LT((r - Vector2d(2.0, -1.0)).norm(), 1e-9);

  seen.ray = RayOf({320.0 - 510.0 * 10.0 / 2.0, 240.0 - 500.0 * 0.5 / 2.0});
  Vector4d quarter(1.0, 0.0, 0.0, M_PI_2);
  const double* turned[] = {quarter.data()};
  ASSERT_TRUE(MakeTurnedProjection(seen)->Evaluate(turned, r.data(), nullptr));
  EXPECT_LT(r.norm(), 1e-9);
}

TEST(TurnedProjection, FailsBehindTheCamera) {
  TurnedProjection seen;
  seen.q_world_cam = AlongX();
  seen.point_m = {-1.0, 0.0, 0.0};
  seen.ray = RayOf({320.0, 240.0});
  Vector4d none = Vector4d::Zero();
  Vector2d r;
  const double* parameters[] = {none.data()};
  EXPECT_FALSE(MakeTurnedProjection(seen)->Evaluate(parameters, r.data(), nullptr));
}

TEST(TurnedProjection, JacobiansMatchDifferences) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 20; ++i) {
    TurnedProjection seen;
    const auto vector = [&] { return Vector3d{unit(random), unit(random), unit(random)}; };
    seen.pivot_m = vector();
    seen.p_cam_m = vector() - Vector3d(2.0, 0.0, 0.0);
    seen.point_m = vector() + Vector3d(6.0, 0.0, 0.0);
    seen.q_world_cam = AlongX() * Eigen::Quaterniond(Eigen::AngleAxisd(0.3, vector().normalized()));
    seen.ray = RayOf({320.0 + 300.0 * unit(random), 240.0 + 200.0 * unit(random)});
    seen.sigma_px = 0.7;
    Vector4d at{unit(random), unit(random), unit(random), 0.3 * unit(random)};
    ExpectJacobiansMatchDifferences(*MakeTurnedProjection(seen), {at.data()}, 1e-6, {at.data()});
  }
}

}  // namespace
}  // namespace camgyro
