// report.html of `camgyro diagnose`.
#ifndef CAMGYRO_TOOLS_DIAGNOSIS_REPORT_H_
#define CAMGYRO_TOOLS_DIAGNOSIS_REPORT_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/diagnosis/diagnose.h"
#include "frontend/track_recording.h"
#include "tools/report/calibration_sections.h"

namespace camgyro {

// The verdict, the rounds, what is left before and after the effects, then the sections of the
// calibration's report. The diagnosis must have a calibration. `pictures` and errors:
// as CalibrationSections.
Result<std::string> DiagnosisReportHtml(const Recording& recording, const SmallPictures& pictures,
                                        const Diagnosis& diagnosis, const RunInfo& run);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_DIAGNOSIS_REPORT_H_
