#include "estimator/odometry/triangulation.h"

#include <gmock/gmock.h>

namespace camgyro {
namespace {

using Eigen::Vector3d;

std::vector<ViewingLine> LinesTo(const Vector3d& point, const std::vector<Vector3d>& centres) {
  std::vector<ViewingLine> lines;
  for (const Vector3d& centre : centres) lines.push_back({centre, (point - centre).normalized()});
  return lines;
}

const Vector3d kPoint(1.0, -2.0, 6.0);
const std::vector<Vector3d> kCentres = {{0, 0, 0}, {0.5, 0.1, 0}, {1.0, 0.0, 0.2}};

TEST(Triangulate, FindsThePointThatLinesMeetIn) {
  const auto point = Triangulate(LinesTo(kPoint, kCentres), 0.01, 0.01);
  ASSERT_TRUE(point);
  EXPECT_LT((*point - kPoint).norm(), 1e-9);
}

TEST(Triangulate, RefusesWhatTheLinesDoNotTell) {
  std::vector<ViewingLine> lines = LinesTo(kPoint, kCentres);
  EXPECT_NEAR(Parallax(lines), std::atan2(1.0, 6.0), 0.05);
  EXPECT_FALSE(Triangulate(lines, 0.3, 0.01)) << "parallax is about 0.16 rad";
  EXPECT_FALSE(Triangulate({lines[0]}, 0.01, 0.01));
  lines[2].direction = (lines[2].direction + Vector3d(0.0, 0.1, 0.0)).normalized();
  EXPECT_FALSE(Triangulate(lines, 0.01, 0.02)) << "one line misses the point by 0.1 rad";
  lines = LinesTo(kPoint, kCentres);
  for (ViewingLine& line : lines) line.direction = -line.direction;
  EXPECT_FALSE(Triangulate(lines, 0.01, 0.01)) << "the point is behind";
}

}  // namespace
}  // namespace camgyro
