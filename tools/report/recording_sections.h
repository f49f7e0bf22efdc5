// What the report shows of the recording itself.
#ifndef CAMGYRO_TOOLS_REPORT_RECORDING_SECTIONS_H_
#define CAMGYRO_TOOLS_REPORT_RECORDING_SECTIONS_H_

#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/residual_table.h"
#include "frontend/track_recording.h"
#include "tools/report/page.h"

namespace camgyro {

// Rates of the gyro, turned into the camera frame and bias removed, over rates between frames that
// the camera alone gives (from the image motion with the calibrated lens, or attitudes); both on
// the gyro's clock.
ReportSection RatesSection(const Recording& recording, const Calibration& calibration);

// Matched features of four pairs spread over the recording, inliers and outliers, over their
// pictures where the recording has any. `residuals`: in the order of pairs (ComputeResiduals).
// Pairs that end at a frame of `pictures` are chosen; without such a pair, pictures are decoded.
// Errors: of decoding.
Result<ReportSection> MatchesSection(const Recording& recording, const SmallPictures& pictures,
                                     const std::vector<MatchResidual>& residuals);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_RECORDING_SECTIONS_H_
