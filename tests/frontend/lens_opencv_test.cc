// Our lenses against OpenCV's.
#include <gmock/gmock.h>

#include <opencv2/calib3d.hpp>
#include <random>

#include "core/lens.h"

namespace camgyro {
namespace {

TEST(Lens, KannalaBrandtAgreesWithOpenCvsFisheye) {
  LensParameters lens = MakePinhole(380.0, {374.0, 242.0}, 1.01);
  lens.tail<4>() << 0.02, -0.01, 0.006, -0.002;
  const cv::Matx33d K(lens[kFocal] * lens[kAspect], 0, lens[kCx], 0, lens[kFocal], lens[kCy], 0, 0,
                      1);
  const cv::Vec4d k(lens[kKb1], lens[kKb2], lens[kKb3], lens[kKb4]);
  const Lens& model = GetLens(DistortionModel::kKannalaBrandt);
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> xy(-2.0, 2.0);  // up to 70 deg
  for (int trial = 0; trial < 50; ++trial) {
    const double scale = trial == 0 ? 1e-4 : 1.0;  // near the axis, the series takes over
    const Eigen::Vector3d point(scale * xy(generator), scale * xy(generator), 1.0);
    std::vector<cv::Point2d> expected;
    cv::fisheye::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}},
                               expected, cv::Vec3d(), cv::Vec3d(), K, k);
    const auto px = model.Project(point, lens);
    ASSERT_TRUE(px.has_value());
    EXPECT_LT((*px - Eigen::Vector2d(expected[0].x, expected[0].y)).norm(), 1e-9);
    RayJet ray;
    ASSERT_TRUE(model.Unproject(*px, lens, &ray));
    EXPECT_LT((ray.ray - point).norm(), 1e-8);
  }
}

}  // namespace
}  // namespace camgyro
