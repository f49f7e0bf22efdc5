// report.html of `camgyro odometry`.
#ifndef CAMGYRO_TOOLS_REPORT_ODOMETRY_REPORT_H_
#define CAMGYRO_TOOLS_REPORT_ODOMETRY_REPORT_H_

#include <string>

#include "estimator/odometry/follow_recording.h"
#include "pipeline/find_loops.h"
#include "tools/report/calibration_sections.h"

namespace camgyro {

// Path from above and from the side with its loops, position and its sigma, speed, biases, tracks,
// events. The run has at least one pose.
std::string OdometryReportHtml(const OdometryRun& run, const LoopClosure& loops,
                               const RunInfo& info);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_ODOMETRY_REPORT_H_
