// What a reader of the calibrator sees, from what its worker knows.
#ifndef CAMGYRO_SNAPSHOT_H_
#define CAMGYRO_SNAPSHOT_H_

#include "camgyro/calibrator.h"
#include "camgyro/online_calibration.h"

namespace camgyro::api {

// The state after a frame or a solved window. A parameter's readiness follows from its sigma, its
// prior and its movement, against the sigmas that the options ask for. Left to the caller: what the
// gyro's stamps are, doubts, and how many frames were dropped.
Snapshot MakeSnapshot(const OnlineCalibration::Progress& progress,
                      const CalibratorOptions& options);

// Would the estimate be ready, if noise were its only error?
bool ReadyButForTotal(const OnlineCalibration::Progress& progress,
                      const CalibratorOptions& options);

}  // namespace camgyro::api

#endif  // CAMGYRO_SNAPSHOT_H_
