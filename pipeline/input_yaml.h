// The part of calibration.yaml that tells what was found in the data before any fit.
#ifndef CAMGYRO_PIPELINE_INPUT_YAML_H_
#define CAMGYRO_PIPELINE_INPUT_YAML_H_

#include <string>

#include "core/recording.h"

namespace camgyro {

// The keys `stamps:` and `faults:`, to be appended to the other keys of a file. Faults are those
// that were mended when the recording was read, and those that are still there (FindDataFaults).
std::string InputYaml(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_INPUT_YAML_H_
