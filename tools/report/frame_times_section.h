// The frames' own times in a calibration's report.
#ifndef CAMGYRO_TOOLS_REPORT_FRAME_TIMES_SECTION_H_
#define CAMGYRO_TOOLS_REPORT_FRAME_TIMES_SECTION_H_

#include "core/recording.h"
#include "estimator/calibrate.h"
#include "tools/report/page.h"

namespace camgyro {

// How far each frame's time is from its stamp, over time and as a distribution. Needs
// CalibrationReport::frame_times.
ReportSection FrameTimesSection(const Recording& recording, const CalibrationReport& report);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_FRAME_TIMES_SECTION_H_
