// What of a calibration is not to be believed, and why.
#ifndef CAMGYRO_ESTIMATOR_DOUBTS_H_
#define CAMGYRO_ESTIMATOR_DOUBTS_H_

#include "core/calibration.h"
#include "core/recording.h"
#include "estimator/calibrate.h"

namespace camgyro {

// Sets calibration->determined: a parameter is determined if the data shrank its prior and the
// result is of practical use. attitudes: of a recording without pixels.
void MarkDetermined(bool attitudes, const Prior& prior, Calibration* calibration);

// Adds to doubts and notes what speaks against a result that is complete otherwise.
void AddDoubts(const Recording& recording, CalibrationReport* report);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DOUBTS_H_
