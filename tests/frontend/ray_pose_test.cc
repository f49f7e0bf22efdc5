#include "frontend/ray_pose.h"

#include <gmock/gmock.h>

#include <random>

namespace camgyro {
namespace {

using Eigen::Vector3d;

// 40 points 2 to 8 m before a camera far from the origin, a third of them mistaken.
struct SeenScene {
  Eigen::Quaterniond q_world_cam =
      Eigen::Quaterniond(Eigen::AngleAxisd(1.3, Vector3d(0.3, -0.8, 0.5).normalized()));
  Vector3d p_world_m{120.0, -35.0, 2.0};
  std::vector<Vector3d> points, rays;
  std::vector<int> right;

  SeenScene() {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < 40; ++i) {
      const double x = unit(random), y = unit(random), depth_m = 5.0 + 3.0 * unit(random);
      Vector3d ray(0.6 * x, 0.5 * y, 1.0);
      points.push_back(p_world_m + q_world_cam * (depth_m * ray));
      const double wrong_x = unit(random), wrong_y = unit(random);
      if (i % 3 == 0) {
        ray += Vector3d(0.3 * wrong_x, 0.3 * wrong_y + (wrong_y > 0 ? 0.1 : -0.1), 0.0);
      } else {
        right.push_back(i);
      }
      rays.push_back(2.5 * ray);  // the length of a ray has no meaning
    }
  }
};

TEST(RayPose, FindsTheCameraAmongMistakes) {
  const SeenScene scene;
  const auto pose = PoseFromRays(scene.points, scene.rays, 0.005);
  ASSERT_TRUE(pose);
  // Floats hold pixels on the plane z = 1 to 1e-7.
  EXPECT_LT((pose->p_world_m - scene.p_world_m).norm(), 1e-3);
  EXPECT_LT(pose->q_world_cam.angularDistance(scene.q_world_cam), 1e-3);
  EXPECT_EQ(pose->inliers, scene.right);
}

TEST(RayPose, SameInputSameResult) {
  const SeenScene scene;
  const auto a = PoseFromRays(scene.points, scene.rays, 0.005);
  const auto b = PoseFromRays(scene.points, scene.rays, 0.005);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->p_world_m, b->p_world_m);
  EXPECT_EQ(a->inliers, b->inliers);
}

TEST(RayPose, RefusesTooFewPoints) {
  SeenScene scene;
  scene.points.resize(3);
  scene.rays.resize(3);
  EXPECT_FALSE(PoseFromRays(scene.points, scene.rays, 0.005));
}

}  // namespace
}  // namespace camgyro
