#include "estimator/odometry/loop_pose.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "core/linear_algebra.h"

namespace camgyro {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kNoisePx = 0.8;

// A camera that moves while its rows are read sees the points of a map that is shifted and turned.
struct LoopScene {
  Vector4d truth{0.8, -1.2, 0.15, 0.06};
  Vector3d pivot{30.0, 12.0, 1.0};
  std::vector<TurnedProjection> sightings;
  size_t wrong = 0;

  LoopScene(uint64_t seed, int count, double wrong_share) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const LensParameters lens = MakePinhole(300.0, {160.0, 120.0});
    Eigen::Matrix3d R;  // looks along x of a world with z up
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const Eigen::AngleAxisd turn(truth[3], Vector3d::UnitZ());
    while (static_cast<int>(sightings.size()) < count) {
      TurnedProjection seen;
      seen.pivot_m = pivot;
      const double u = unit(random), v = unit(random), depth_m = 4.0 + 2.5 * unit(random);
      const double row = 0.5 * v;  // of the readout, from the middle
      seen.p_cam_m = pivot + Vector3d(-0.5, 0.3, 0.1) + row * Vector3d(0.03, 0.0, 0.01);
      seen.q_world_cam =
          Quaterniond(R) * Quaterniond(Eigen::AngleAxisd(0.05 * row, Vector3d::UnitY()));
      Vector2d px(160.0 + 150.0 * u, 120.0 + 110.0 * v);
      RayJet ray;
      EXPECT_TRUE(
          GetLens(DistortionModel::kNone).Unproject(px, lens, &ray, LensDerivatives::kNone));
      const Vector3d in_older = seen.p_cam_m + seen.q_world_cam * (depth_m * ray.ray);
      seen.point_m = turn.inverse() * (in_older - pivot - truth.head<3>()) + pivot;
      const double noise_u = normal(random), noise_v = normal(random);
      px += kNoisePx * Vector2d(noise_u, noise_v);
      const double wrong_u = unit(random), wrong_v = unit(random);
      if (0.5 * (1.0 + unit(random)) < wrong_share) {
        px += Vector2d(60.0 * wrong_u, 60.0 * wrong_v);
        ++wrong;
      }
      EXPECT_TRUE(
          GetLens(DistortionModel::kNone).Unproject(px, lens, &seen.ray, LensDerivatives::kNone));
      sightings.push_back(seen);
    }
  }
};

// e' C^-1 e / 4 over many scenes is 1, and the noise is that of the pixels.
TEST(LoopPose, IsAsGoodAsItSays) {
  double nees = 0.0, noise_px = 0.0;
  constexpr int kScenes = 60;
  for (uint64_t seed = 1; seed <= kScenes; ++seed) {
    const LoopScene scene(seed, 60, 0.0);
    const auto pose = FitLoopPose(scene.sightings, Vector4d::Zero());
    ASSERT_TRUE(pose) << pose.error().message;
    const Vector4d e = pose->shift_turn - scene.truth;
    nees += SquaredMahalanobis(e, pose->covariance) / 4.0 / kScenes;
    noise_px += pose->noise_px / kScenes;
  }
  EXPECT_NEAR(noise_px, kNoisePx, 0.08 * kNoisePx);
  // 240 degrees of freedom: 99 % within 0.78 and 1.25.
  EXPECT_GT(nees, 0.75);
  EXPECT_LT(nees, 1.4);
}

TEST(LoopPose, WrongSightingsLeave) {
  const LoopScene scene(3, 80, 0.25);
  const auto pose = FitLoopPose(scene.sightings, scene.truth + Vector4d(0.1, -0.1, 0.05, 0.02));
  ASSERT_TRUE(pose);
  EXPECT_GT(scene.wrong, 10u);
  EXPECT_LT(pose->inliers.size(), scene.sightings.size() - scene.wrong + 4);
  EXPECT_GT(pose->inliers.size(), scene.sightings.size() - scene.wrong - 4);
  const Vector4d e = pose->shift_turn - scene.truth;
  EXPECT_LT(SquaredMahalanobis(e, pose->covariance), 25.0);
}

TEST(LoopPose, RefusesWhatTellsNothing) {
  LoopScene scene(5, 5, 0.0);
  EXPECT_FALSE(FitLoopPose(scene.sightings, Vector4d::Zero()));
}

TEST(LoopPose, TurnBetweenPosesAndWhatIsLeftOfTilt) {
  const Quaterniond from(Eigen::AngleAxisd(2.9, Vector3d(0.5, 0.8, -0.2).normalized()));
  const Vector3d p(3.0, -1.0, 2.0), pivot(1.0, 1.0, 0.0), shift(0.2, 0.3, -0.1);
  const Quaterniond turn(Eigen::AngleAxisd(-0.7, Vector3d::UnitZ()));
  const Quaterniond tilt(Eigen::AngleAxisd(0.05, Vector3d::UnitX()));
  const TurnAndTilt found =
      TurnBetween(from, p, turn * from, turn * (p - pivot) + pivot + shift, pivot);
  EXPECT_LT((found.shift_turn.head<3>() - shift).norm(), 1e-9);
  EXPECT_NEAR(found.shift_turn[3], -0.7, 1e-9);
  EXPECT_NEAR(found.tilt_rad, 0.0, 1e-7);
  EXPECT_NEAR(TurnBetween(from, p, tilt * turn * from, p, pivot).tilt_rad, 0.05, 1e-3);
}

}  // namespace
}  // namespace camgyro
