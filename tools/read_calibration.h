// Reads a calibration.yaml back (design.md section 7).
#ifndef CAMGYRO_TOOLS_READ_CALIBRATION_H_
#define CAMGYRO_TOOLS_READ_CALIBRATION_H_

#include <string>

#include "core/calibration.h"
#include "core/result.h"

namespace camgyro {

// Values only: the covariance stays zero. Errors: kBadInput naming file and key; a calibration from
// attitudes has no lens and is refused.
Result<Calibration> ReadCalibration(const std::string& file);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_READ_CALIBRATION_H_
