// Exit code 4 for scripts: was anything determined, and what --require asks for?
#ifndef CAMGYRO_TOOLS_REQUIRED_H_
#define CAMGYRO_TOOLS_REQUIRED_H_

#include "core/calibration.h"
#include "core/result.h"

namespace camgyro {

// Error (bad usage) if --require names something that is no parameter.
Status CheckRequireFlag();

// kCannotEstimate if no parameter was determined, or not all that --require names. Where only
// attitudes were there, parameters that need pixels are not expected, unless required.
Status CheckDetermined(const Calibration& calibration);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REQUIRED_H_
