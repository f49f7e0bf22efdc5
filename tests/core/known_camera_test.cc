#include "core/known_camera.h"

#include <gtest/gtest.h>

#include "core/division_lens.h"

namespace camgyro {
namespace {

CameraGuess Camera() {
  CameraGuess camera;
  camera.width_px = 752;
  camera.height_px = 480;
  return camera;
}

TEST(KnownCamera, IsTheDeclaredOne) {
  CameraGuess camera = Camera();
  EXPECT_EQ(KnownCamera(camera, 450.0).lens, MakePinhole(450.0, {375.5, 239.5}));
  camera.principal_px = Eigen::Vector2d(360.0, 250.0);
  camera.aspect_ratio = 1.01;
  camera.distortion_model = DistortionModel::kKannalaBrandt;
  camera.distortion = {0.1, 0.02, 0.003, 0.0004};
  const Calibration c = KnownCamera(camera, 450.0);
  EXPECT_EQ(c.width_px, 752);
  EXPECT_EQ(c.distortion_model, DistortionModel::kKannalaBrandt);
  LensParameters lens = MakePinhole(450.0, {360.0, 250.0}, 1.01);
  lens.segment<4>(kKb1) << 0.1, 0.02, 0.003, 0.0004;
  EXPECT_EQ(c.lens, lens);
}

// Whatever the focal length, the pixels of a lens that the matches show go where it sends them.
TEST(KnownCamera, ShowsAPinholesMatches) {
  CameraGuess camera = Camera();
  camera.division_lambda = -0.2;
  const DivisionLens division(-0.2, camera.Centre(), {752.0, 480.0});
  Match match;
  match.px_a = {600.0, 100.0};
  match.px_b = {80.0, 420.0};
  for (const double focal_px : {350.0, 700.0}) {
    const std::vector<Match> seen = ThroughPinhole(KnownCamera(camera, focal_px), {match});
    ASSERT_EQ(seen.size(), 1U);
    EXPECT_LT((seen.front().px_a - division.Undistorted(match.px_a)).norm(), 1.0);
    EXPECT_LT((seen.front().px_b - division.Undistorted(match.px_b)).norm(), 1.0);
  }
  EXPECT_EQ(DeclaredCamera(camera, 350.0).lens, MakePinhole(350.0, camera.Centre()));
}

TEST(KnownCamera, LeavesOutWhatHasNoRay) {
  CameraGuess camera = Camera();
  camera.distortion_model = DistortionModel::kRadTan;
  camera.distortion = {-0.3, 0.0, 0.0, 0.0};
  Match inside, outside;
  inside.px_a = inside.px_b = {400.0, 240.0};
  outside = inside;
  outside.px_b = {2000.0, 240.0};
  EXPECT_EQ(ThroughPinhole(KnownCamera(camera, 450.0), {inside, outside}).size(), 1U);
}

}  // namespace
}  // namespace camgyro
