// The files of `camgyro odometry` (docs/odometry.md).
#ifndef CAMGYRO_TOOLS_ODOMETRY_FILES_H_
#define CAMGYRO_TOOLS_ODOMETRY_FILES_H_

#include <string>
#include <vector>

#include "estimator/odometry/follow_recording.h"
#include "estimator/odometry/gyro_rate_trajectory.h"
#include "pipeline/find_loops.h"

namespace camgyro {

// odometry.yaml: verdict, events, loops, the calibration as refined.
std::string OdometryYaml(const OdometryRun& run, const LoopClosure& loops);

// "time x y z qx qy qz qw" [s of the gyro's clock, m]: the gyro frame in the world, z up. The
// format of the TUM RGB-D benchmark.
std::string TrajectoryTum(const std::vector<OdometryPose>& poses);
std::string TrajectoryTum(const std::vector<StateAtTime>& states);

// Everything of the poses, one row each, with the covariance of position and rotation.
std::string PosesCsv(const std::vector<OdometryPose>& poses);

// ASCII PLY.
std::string PointsPly(const std::vector<MappedPoint>& points);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_ODOMETRY_FILES_H_
