// The page of a way: what hours of it weigh.
#include "tools/report/odometry_report.h"

#include <gmock/gmock.h>

namespace camgyro {
namespace {

// At 30 frames/s.
OdometryRun RunOf(double seconds) {
  OdometryRun run;
  for (int i = 0; i < 30.0 * seconds; ++i) {
    OdometryPose pose;
    pose.time_ns = static_cast<int64_t>(i) * 33'333'333;
    pose.state.p_world_m = Eigen::Vector3d(0.1234567 * i, 0.7654321, 0.3);
    run.poses.push_back(pose);
    if (i % 9 == 0) run.keyframes.push_back(pose);
    MappedPoint point;
    point.p_world_m = pose.state.p_world_m + Eigen::Vector3d(0.1, 1.23456, 0.7);
    run.points.push_back(point);
  }
  return run;
}

size_t BytesOf(double seconds) {
  return OdometryReportHtml(RunOf(seconds), {}, {"camgyro odometry", "", {}, "", "odometry.yaml"})
      .size();
}

TEST(OdometryReport, IsNoLargerForAnHourThanABrowserLikes) {
  const size_t minute = BytesOf(60.0), hour = BytesOf(3600.0);
  EXPECT_GT(hour, minute);
  EXPECT_LT(hour, 4'000'000u);
}

}  // namespace
}  // namespace camgyro
