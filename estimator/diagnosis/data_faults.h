// Faults that the data show without a fit, and recordings that no model repairs.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_DATA_FAULTS_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_DATA_FAULTS_H_

#include <optional>
#include <string>
#include <vector>

#include "core/recording.h"
#include "estimator/start/find_start.h"
#include "estimator/start/focal_scan.h"

namespace camgyro {

// A property of the data, named as in the catalogue where that has it.
struct DataFault {
  std::string name;
  std::string finding;
  std::string advice;
  int count = 1;  // of samples, frames, gaps, or of the fault itself
};

// Samples at the full scale, dropped and duplicated frames, dropped samples, a rate of samples that
// is not what the file declares.
std::vector<DataFault> FindDataFaults(const Recording& recording);

// Leaves out frames that repeat the picture before them, one or several in a row, while the camera
// moves: their stamps belong to another picture. For tracks without identity across such a frame
// nothing is lost. Records the fault and returns how many; a recording with repeats in more than
// half of the places stays as it is.
int DropRepeatedPictures(Recording* recording);

// Is the picture without the fast rotation that the gyro has? Compares the power of the rates below
// 0.5 Hz and above 1 Hz, which needs neither delay nor mounting. `rotations`: of the camera, some
// 0.1 s long or shorter, at least 60. The finding, or nothing.
std::optional<std::string> FindElectronicStabilisation(
    const Recording& recording, const std::vector<CameraRotation>& rotations);

// A recording whose start was refused: does it fit with the gyro in another unit (deg/s), or with
// one axis mirrored (a wrong order of axes is a mirror, too)? Repairs the gyro and says what it
// was.
std::optional<DataFault> RepairGyro(const CameraRotationsAt& rotations_at,
                                    const StartOptions& options, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_DATA_FAULTS_H_
