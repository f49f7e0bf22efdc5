// The tables of a batch: what became of each recording, and how well those of a device agree.
#ifndef CAMGYRO_TOOLS_BATCH_TABLES_H_
#define CAMGYRO_TOOLS_BATCH_TABLES_H_

#include <optional>
#include <string>
#include <vector>

#include "estimator/calibrate.h"
#include "pipeline/device.h"
#include "tools/batch/manifest.h"
#include "tools/batch/outcome.h"

namespace camgyro::batch {

struct BatchResult {
  BatchRecording recording;
  Outcome outcome;
  std::optional<CalibrationReport> report;  // of a recording with a calibration.yaml
  std::string left_out;                     // why it is not part of its device; empty if it is
};

// The results of one device, in the order of the manifest, and what they say together; without
// `combined` if none of them has a calibration. Its recordings are those that are not left out.
struct BatchDevice {
  std::string name;
  std::vector<BatchResult> results;
  std::optional<DeviceReport> combined;
};

// One row per recording: device, recording, folder, exit_code, combined (true or false), odd (the
// parameter in which the others contradict it), value, sigma and total sigma of every parameter, in
// the units of calibration.yaml, the rotation counted from the device's; message.
std::string RecordingsCsv(const std::vector<BatchDevice>& devices);

// One row per parameter of the device: value with its sigmas, and how well the recordings repeat
// it.
std::string DeviceCsv(const BatchDevice& device);

// The same for people, with a chart for every parameter.
std::string DevicePage(const BatchDevice& device);

}  // namespace camgyro::batch

#endif  // CAMGYRO_TOOLS_BATCH_TABLES_H_
