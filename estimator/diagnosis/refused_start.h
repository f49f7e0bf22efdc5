// What is wrong with a recording whose start was refused.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_REFUSED_START_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_REFUSED_START_H_

#include <optional>
#include <string>
#include <vector>

#include "core/recording.h"
#include "estimator/diagnosis/data_faults.h"
#include "estimator/start/find_start.h"
#include "estimator/start/focal_scan.h"

namespace camgyro {

// Does the recording fit with the gyro in another unit (deg/s), with one of its axes mirrored (a
// wrong order of axes is a mirror, too), with accelerometer and gyro exchanged, or with the stamps
// of one of both slowed down or sped up, as those of a slow motion are that is stamped as it is
// played? Repairs the recording, records the fault, and says what it was; without an answer it
// stays as it is.
std::optional<DataFault> RepairRecording(const CameraRotationsAt& rotations_at,
                                         const StartOptions& options, Recording* recording);

// Is the picture without the fast rotation that the gyro has, but with the slow one? Compares the
// power of the rates below 0.5 Hz and above 1 Hz, which needs neither delay nor mounting, and finds
// the slow rotation of the one in the other. `rotations`: of the camera, some 0.1 s long or
// shorter, at least 60. The finding, or nothing.
std::optional<std::string> FindElectronicStabilisation(
    const Recording& recording, const std::vector<CameraRotation>& rotations);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_REFUSED_START_H_
