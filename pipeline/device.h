// One device from several of its recordings.
#ifndef CAMGYRO_PIPELINE_DEVICE_H_
#define CAMGYRO_PIPELINE_DEVICE_H_

#include <string>
#include <vector>

#include "core/result.h"
#include "estimator/calibrate.h"
#include "pipeline/combine.h"

namespace camgyro {

// Is an effect of this name the device's (its lens, its gyro)? Others belong to a recording:
// clocks, focus, exposure, temperature.
bool IsEffectOfDevice(const std::string& name);

struct DeviceReport {
  // Its calibration is the device's: lens, readout, mounting, and those fitted effects that belong
  // to the device, of all recordings together; delay and bias are the mean of what the recordings
  // have had, with the next one's spread in the total. `systematic` has "between_recordings" beside
  // the effects.
  CalibrationReport report;
  bool attitudes = false;
  std::vector<std::string> recordings;
  std::vector<Calibration> each;
  // The state's parameters, then those of effects ("gyro_scale x"), as in `combined`.
  std::vector<std::string> parameters;
  std::vector<bool> shared;
  CombinedEstimate combined;
};

// reports: of recordings of one camera and one gyro, at least one. attitudes: without pixels.
// Errors: kBadInput where the recordings cannot be of one camera: other sizes of the picture, other
// declared distortion.
Result<DeviceReport> CombineToDevice(const std::vector<std::string>& names,
                                     const std::vector<const CalibrationReport*>& reports,
                                     bool attitudes);

// calibration.yaml of the device (docs/result_format.md): that of a recording, and `recordings`.
std::string DeviceYaml(const DeviceReport& device);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_DEVICE_H_
