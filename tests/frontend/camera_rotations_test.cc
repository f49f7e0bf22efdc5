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

TEST(PairsForRotations, AreChosenBeforeTheirMatchesAreMade) {
  Recording recording;
  for (int i = 0; i < 301; ++i) {
    recording.frames.emplace_back().stamp_ns = 33'000'000LL * i;
    recording.tracks.push_back({{1, {1.0 * i, 0.0}}, {2, {0.0, 1.0 * i}}});
  }
  const std::vector<FramePair> all = PairsForRotations(recording);  // 0.1 s: three frames
  ASSERT_EQ(all.size(), 100u);
  const std::vector<FramePair> some = PairsForRotations(recording, 30);
  ASSERT_EQ(some.size(), 30u);
  for (size_t i = 0; i < some.size(); ++i) {
    const FramePair& same = all[i * 100 / 30];
    EXPECT_EQ(some[i].frame_a, same.frame_a);
    EXPECT_EQ(some[i].frame_b, same.frame_a + 3);
    ASSERT_EQ(some[i].matches.size(), 2u);
    EXPECT_EQ(some[i].matches[0].px_b.x(), some[i].frame_b);
  }
  recording.matches = all;
  recording.matches.resize(50);
  EXPECT_EQ(PairsForRotations(recording).size(), 50u);
  EXPECT_EQ(PairsForRotations(recording, 10)[3].frame_a, all[15].frame_a);
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
