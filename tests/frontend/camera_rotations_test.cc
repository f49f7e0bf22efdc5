#include "frontend/camera_rotations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/so3.h"
#include "tests/frontend/two_view_scene.h"

namespace camgyro {
namespace {

// A motion that is followed from one focal length to the next is the one that a search there finds,
// but for pairs whose motion has two minima that are about as good.
TEST(CameraRotationsOf, FollowsWhatASearchFinds) {
  TwoViewScene scene;
  scene.q_a_b = Exp(Eigen::Vector3d(0.02, -0.03, 0.015));
  scene.p_a = Eigen::Vector3d(0.08, -0.02, 0.05);
  scene.noise_px = 0.3;
  std::vector<FramePair> pairs;
  for (unsigned seed = 0; seed < 40; ++seed) {
    pairs.push_back(scene.Make(100, seed));
    pairs.back().frame_a = static_cast<int>(seed);
  }
  CameraGuess camera;
  camera.width_px = 640;
  camera.height_px = 480;
  std::vector<double> focals_px;
  for (int k = 0; k < 8; ++k) focals_px.push_back(350.0 * std::pow(1.07, k));
  const auto followed = CameraRotationsOf(pairs, camera, focals_px);
  ASSERT_EQ(followed.size(), focals_px.size());
  int same = 0, all = 0;
  for (size_t k = 0; k < focals_px.size(); ++k) {
    const std::vector<CameraRotation> searched =
        CameraRotationsOf(pairs, camera, {focals_px[k]}).front();
    ASSERT_EQ(followed[k].size(), searched.size());
    for (size_t i = 0; i < searched.size(); ++i) {
      ASSERT_EQ(followed[k][i].frame_a, searched[i].frame_a);
      const double apart_rad = followed[k][i].q_a_b.angularDistance(searched[i].q_a_b);
      same += apart_rad < 0.2 * searched[i].sigma_rad;
      ++all;
    }
  }
  EXPECT_EQ(all, 320);
  EXPECT_GE(same, 0.95 * all);
}

TEST(CameraRotationsOf, LeavesOutPairsThatHaveNone) {
  TwoViewScene scene;
  scene.p_a = Eigen::Vector3d(0.08, -0.02, 0.05);
  const std::vector<FramePair> pairs = {scene.Make(100, 1), scene.Make(5, 2), scene.Make(100, 3)};
  CameraGuess camera;
  camera.width_px = 640;
  camera.height_px = 480;
  const auto found = CameraRotationsOf(pairs, camera, {450.0, 480.0});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].size(), 2u);
  EXPECT_EQ(found[1].size(), 2u);
  EXPECT_TRUE(CameraRotationsOf(pairs, camera, {}).empty());
}

}  // namespace
}  // namespace camgyro
