#include "frontend/patch_alignment.h"

#include <gmock/gmock.h>

#include <random>
#include <vector>

#include "core/linear_algebra.h"
#include "tests/frontend/waves.h"

namespace camgyro {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int kWidth = 320, kHeight = 240, kWindow = 31;

// A second picture, and where it shows a pixel of the first.
struct View {
  cv::Mat picture;
  Matrix2d warp;
  Vector2d shift;
  // Scene points are pixels of the first picture.
  Vector2d Find(const Vector2d& px) const { return warp.inverse() * (px + shift); }
};

View Warped(const Waves& scene, const Matrix2d& change, const Vector2d& move) {
  View view;
  view.warp = change;
  const Vector2d middle(0.5 * kWidth, 0.5 * kHeight);  // about which it turns
  view.shift = change * (middle + move) - middle;
  view.picture = scene.Render(kWidth, kHeight, view.shift, change);
  return view;
}

std::vector<Vector2d> Places() {
  std::vector<Vector2d> places;
  for (double v = 40.3; v < kHeight - 40; v += 19.7) {
    for (double u = 40.6; u < kWidth - 40; u += 19.3) places.emplace_back(u, v);
  }
  return places;
}

TEST(AlignPatch, FindsWhatTurnsShearsGrowsAndGetsBrighter) {
  const Waves scene(1, 0.0);
  const cv::Mat first = scene.Render(kWidth, kHeight, {0, 0});
  Matrix2d change;
  change << 1.03, -0.05, 0.02, 0.97;
  View view = Warped(scene, change, {3.4, -2.7});
  view.picture.convertTo(view.picture, CV_8U, 0.9, 12.0);
  int found = 0;
  double sum_sq = 0.0;
  for (const Vector2d& place : Places()) {
    const Vector2d truth = view.Find(place);
    const auto aligned =
        AlignPatch(first, place, view.picture, truth + Vector2d(0.3, -0.2), kWindow);
    if (!aligned) continue;
    ++found;
    sum_sq += (aligned->px - truth).squaredNorm();
  }
  ASSERT_GT(found, 80);
  // Rounding to 8 bits, and what linear interpolation makes of waves of 8 px and more.
  EXPECT_LT(std::sqrt(sum_sq / found), 0.02);
}

TEST(AlignPatch, CovarianceIsThatOfItsErrors) {
  const Waves scene(2, 0.0);
  const cv::Mat clean = scene.Render(kWidth, kHeight, {0, 0});
  const View view = Warped(scene, Matrix2d::Identity(), {0.0, 0.0});
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0.0, 3.0);
  const auto noisy = [&](cv::Mat picture) {
    for (int v = 0; v < picture.rows; ++v) {
      for (int u = 0; u < picture.cols; ++u) {
        picture.at<uchar>(v, u) =
            cv::saturate_cast<uchar>(picture.at<uchar>(v, u) + noise(generator));
      }
    }
    return picture;
  };
  double chi2 = 0.0;
  int count = 0;
  for (int run = 0; run < 10; ++run) {
    const cv::Mat before = noisy(clean.clone()), after = noisy(view.picture.clone());
    for (const Vector2d& place : Places()) {
      const Vector2d whole(std::round(place.x()), std::round(place.y()));  // no interpolation
      const auto aligned = AlignPatch(before, whole, after, whole, kWindow);
      if (!aligned) continue;
      const Vector2d error = aligned->px - whole;
      // Noise of both pictures.
      chi2 += SquaredMahalanobis(error, aligned->covariance) / (2.0 * 3.0 * 3.0);
      count += 2;
    }
  }
  ASSERT_GT(count, 1000);
  EXPECT_NEAR(chi2 / count, 1.0, 0.2);
}

TEST(AlignPatch, SaysNothingWithoutTextureOrOutsideOfThePicture) {
  const Waves scene(1, 0.0);
  const cv::Mat picture = scene.Render(kWidth, kHeight, {0, 0});
  const cv::Mat wall(kHeight, kWidth, CV_8U, cv::Scalar(90));
  EXPECT_FALSE(AlignPatch(wall, {100, 100}, wall, {100, 100}, kWindow));
  EXPECT_TRUE(AlignPatch(picture, {100, 100}, picture, {100.2, 100}, kWindow));
  EXPECT_FALSE(AlignPatch(picture, {10, 100}, picture, {100, 100}, kWindow));
  EXPECT_FALSE(AlignPatch(picture, {100, 100}, picture, {100, 232}, kWindow));
  // Widths that are even, or larger than a patch may be.
  EXPECT_FALSE(AlignPatch(picture, {100, 100}, picture, {100.2, 100}, kMaxPatchPx - 1));
  EXPECT_FALSE(AlignPatch(picture, {100, 100}, picture, {100.2, 100}, kMaxPatchPx + 2));
  // Not what was expected there.
  EXPECT_FALSE(AlignPatch(picture, {100, 100}, picture, {220, 160}, kWindow));
}

}  // namespace
}  // namespace camgyro
