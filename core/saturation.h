// Gyro samples at the rail: their rates are only a lower bound.
#ifndef CAMGYRO_CORE_SATURATION_H_
#define CAMGYRO_CORE_SATURATION_H_

#include <vector>

#include "core/recording.h"

namespace camgyro {

// Which samples stay at the gyro's full scale: the largest magnitude of an axis, if it is taken far
// more often than values just below it.
std::vector<bool> FindSaturated(const std::vector<GyroSample>& gyro);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_SATURATION_H_
