// Flags of the commands that fit matches: what a match is held against, and the loss.
#ifndef CAMGYRO_TOOLS_FIT_FLAGS_H_
#define CAMGYRO_TOOLS_FIT_FLAGS_H_

#include <string>
#include <vector>

#include "core/effects/device_class.h"
#include "core/result.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// Names of the flags that ReadFitFlags obeys.
std::vector<std::string> FitFlags();

// --device. Errors: kBadUsage.
Result<DeviceClass> DeviceFromFlag();

// --effects, as MakeEffects takes it: "usual" without a class is that of the device.
std::string EffectsFromFlag(DeviceClass device);

Status ReadFitFlags(PairGraphOptions* options);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_FIT_FLAGS_H_
