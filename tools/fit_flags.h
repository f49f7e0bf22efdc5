// Flags of the commands that fit matches: what a match is held against, and the loss.
#ifndef CAMGYRO_TOOLS_FIT_FLAGS_H_
#define CAMGYRO_TOOLS_FIT_FLAGS_H_

#include <string>
#include <vector>

#include "core/result.h"
#include "estimator/diagnosis/device_class.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// Names of the flags that ReadFitFlags obeys.
std::vector<std::string> FitFlags();

// --device. Errors: kBadUsage.
Result<DeviceClass> DeviceFromFlag();

Status ReadFitFlags(PairGraphOptions* options);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_FIT_FLAGS_H_
