// report.html of `camgyro calibrate`.
#ifndef CAMGYRO_TOOLS_REPORT_CALIBRATE_REPORT_H_
#define CAMGYRO_TOOLS_REPORT_CALIBRATE_REPORT_H_

#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/calibrate.h"
#include "frontend/track_recording.h"
#include "tools/report/calibration_sections.h"
#include "tools/report/page.h"

namespace camgyro {

// All sections, in their order: result, motion, convergence, delay, rates, residuals at the start
// and now, fit, matches, reproduction. Recordings of attitudes have no residuals and matches.
// `pictures`: what tracking has kept (MatchesSection). Errors: of decoding others.
Result<std::vector<ReportSection>> CalibrationSections(const Recording& recording,
                                                       const SmallPictures& pictures,
                                                       const CalibrationReport& report,
                                                       const RunInfo& run);

// The page with these sections.
Result<std::string> CalibrationReportHtml(const Recording& recording, const SmallPictures& pictures,
                                          const CalibrationReport& report, const RunInfo& run);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_CALIBRATE_REPORT_H_
