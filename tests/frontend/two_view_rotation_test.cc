#include "frontend/two_view_rotation.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/so3.h"
#include "tests/frontend/two_view_scene.h"

namespace camgyro {
namespace {

const Lens& Pinhole() { return GetLens(DistortionModel::kNone); }

double ErrorRad(const CameraRotation& found, const Eigen::Quaterniond& truth) {
  return Log(Eigen::Quaterniond(truth.conjugate() * found.q_a_b)).norm() / std::sqrt(3.0);
}

TwoViewScene WalkingScene() {
  TwoViewScene scene;
  scene.q_a_b = Exp(Eigen::Vector3d(0.02, -0.03, 0.015));
  scene.p_a = Eigen::Vector3d(0.08, -0.02, 0.05);
  return scene;
}

TEST(EstimateCameraRotation, IsExactOnExactMatches) {
  TwoViewScene scene = WalkingScene();
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.08, -0.02, 0.05), Eigen::Vector3d(0, 0, 0.1),
                                   Eigen::Vector3d(0, 0, -0.1), Eigen::Vector3d(-0.05, 0.1, 0)}) {
    SCOPED_TRACE(p.transpose());
    scene.p_a = p;
    FramePair pair = scene.Make(100, 1);
    pair.frame_a = 7;
    pair.frame_b = 9;
    const auto rotation = EstimateCameraRotation(pair, Pinhole(), scene.lens);
    ASSERT_TRUE(rotation.has_value());
    EXPECT_LT(ErrorRad(*rotation, scene.q_a_b), 1e-6);
    EXPECT_EQ(rotation->frame_a, 7);
    EXPECT_EQ(rotation->frame_b, 9);
  }
}

TEST(EstimateCameraRotation, LargeTurnsWork) {
  TwoViewScene scene = WalkingScene();
  scene.q_a_b = Exp(Eigen::Vector3d(0.1, 0.25, 0.3));
  const auto rotation = EstimateCameraRotation(scene.Make(100, 2), Pinhole(), scene.lens);
  ASSERT_TRUE(rotation.has_value());
  EXPECT_LT(ErrorRad(*rotation, scene.q_a_b), 1e-6);
}

TEST(EstimateCameraRotation, SigmaIsTheErrorInTheMean) {
  TwoViewScene scene = WalkingScene();
  scene.p_a *= 2.0;  // parallax well above the noise
  scene.noise_px = 0.3;
  std::vector<double> nees;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const auto rotation = EstimateCameraRotation(scene.Make(100, seed), Pinhole(), scene.lens);
    ASSERT_TRUE(rotation.has_value());
    nees.push_back(std::pow(ErrorRad(*rotation, scene.q_a_b) / rotation->sigma_rad, 2.0));
  }
  double mean = 0.0;
  for (const double value : nees) mean += value / static_cast<double>(nees.size());
  EXPECT_GT(mean, 0.5);
  EXPECT_LT(mean, 2.0);
}

TEST(EstimateCameraRotation, PureRotationWorks) {
  TwoViewScene scene = WalkingScene();
  scene.p_a.setZero();
  scene.noise_px = 0.3;
  int found = 0;
  std::vector<double> errors;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto rotation = EstimateCameraRotation(scene.Make(100, seed), Pinhole(), scene.lens);
    if (!rotation) continue;
    ++found;
    errors.push_back(ErrorRad(*rotation, scene.q_a_b));
  }
  EXPECT_GE(found, 36);
  std::nth_element(errors.begin(), errors.begin() + 18, errors.end());
  // 0.42 px / 500 px / sqrt(100) = 0.085 mrad if the rotation were all there is to find.
  EXPECT_LT(errors[18], 1e-3);
}

TEST(EstimateCameraRotation, WrongMatchesDoLittleHarm) {
  TwoViewScene scene = WalkingScene();
  scene.noise_px = 0.3;
  std::vector<double> errors;
  for (unsigned seed = 0; seed < 40; ++seed) {
    FramePair pair = scene.Make(100, seed);
    SpoilMatches(10, seed, &pair);
    const auto rotation = EstimateCameraRotation(pair, Pinhole(), scene.lens);
    if (rotation) errors.push_back(ErrorRad(*rotation, scene.q_a_b));
  }
  ASSERT_GE(errors.size(), 36u);
  std::nth_element(errors.begin(), errors.begin() + 18, errors.end());
  EXPECT_LT(errors[18], 1.5e-3);
}

TEST(EstimateCameraRotation, TranslationBiasesOnlyTheRotationAlone) {
  TwoViewScene scene = WalkingScene();
  scene.noise_px = 0.3;
  TwoViewOptions alone;
  alone.with_translation = false;
  double joint_sq = 0.0, alone_sq = 0.0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    const FramePair pair = scene.Make(100, seed);
    const auto joint = EstimateCameraRotation(pair, Pinhole(), scene.lens);
    const auto rotation = EstimateCameraRotation(pair, Pinhole(), scene.lens, alone);
    ASSERT_TRUE(joint.has_value() && rotation.has_value());
    joint_sq += std::pow(ErrorRad(*joint, scene.q_a_b), 2.0);
    alone_sq += std::pow(ErrorRad(*rotation, scene.q_a_b), 2.0);
  }
  EXPECT_LT(9.0 * joint_sq, alone_sq);
}

TEST(EstimateCameraRotation, RotationAloneHasItsOwnSigma) {
  TwoViewScene scene = WalkingScene();
  scene.p_a.setZero();
  scene.noise_px = 0.3;
  TwoViewOptions alone;
  alone.with_translation = false;
  double nees = 0.0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const auto rotation =
        EstimateCameraRotation(scene.Make(100, seed), Pinhole(), scene.lens, alone);
    ASSERT_TRUE(rotation.has_value());
    nees += std::pow(ErrorRad(*rotation, scene.q_a_b) / rotation->sigma_rad, 2.0) / 100.0;
  }
  EXPECT_GT(nees, 0.6);
  EXPECT_LT(nees, 1.5);
}

TEST(EstimateCameraRotation, RefusesWhatDoesNotDetermineIt) {
  const TwoViewScene scene = WalkingScene();
  EXPECT_FALSE(EstimateCameraRotation(scene.Make(10, 3), Pinhole(), scene.lens).has_value());
  EXPECT_FALSE(EstimateCameraRotation({}, Pinhole(), scene.lens).has_value());

  FramePair nan = scene.Make(20, 3);
  for (size_t i = 0; i < 10; ++i) {
    nan.matches[i].px_b.x() = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_FALSE(EstimateCameraRotation(nan, Pinhole(), scene.lens).has_value());

  FramePair one_point = scene.Make(1, 4);
  one_point.matches.resize(30, one_point.matches[0]);
  EXPECT_FALSE(EstimateCameraRotation(one_point, Pinhole(), scene.lens).has_value());
}

TEST(CameraRotationsFromAttitudes, AreOfTheInverseSequence) {
  // The camera turns about its own x by 0.1 rad per frame from any attitude: R_w_c[i+1] =
  // R_w_c[i] Exp(0.1 x), so R_a_b = R_c_w[a] R_w_c[b] = Exp(0.1 gap x).
  const Eigen::Quaterniond q_world_cam = Exp(Eigen::Vector3d(0.7, -1.1, 0.4));
  std::vector<Eigen::Quaterniond> q_cam_world;
  for (int i = 0; i < 5; ++i) {
    q_cam_world.push_back((q_world_cam * Exp(Eigen::Vector3d(0.1 * i, 0.0, 0.0))).conjugate());
  }
  for (const int gap : {1, 3}) {
    const auto rotations = CameraRotationsFromAttitudes(q_cam_world, gap);
    ASSERT_EQ(rotations.size(), static_cast<size_t>(5 - gap));
    for (size_t i = 0; i < rotations.size(); ++i) {
      EXPECT_EQ(rotations[i].frame_a, static_cast<int>(i));
      EXPECT_EQ(rotations[i].frame_b, static_cast<int>(i) + gap);
      EXPECT_LT((Log(rotations[i].q_a_b) - Eigen::Vector3d(0.1 * gap, 0, 0)).norm(), 1e-12);
    }
  }
  EXPECT_TRUE(CameraRotationsFromAttitudes(q_cam_world, 5).empty());
}

}  // namespace
}  // namespace camgyro
