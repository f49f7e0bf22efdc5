// Axes of a gyro that measure nothing, or that a logger forgot.
#ifndef CAMGYRO_CORE_CONSTANT_AXES_H_
#define CAMGYRO_CORE_CONSTANT_AXES_H_

#include <algorithm>
#include <string>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Those that read the same value in all of at least 100 samples, while another one does not, as
// "x", "y", "z" or two of these. Empty: none.
inline std::string ConstantAxes(const std::vector<GyroSample>& gyro) {
  constexpr size_t kFewest = 100;
  std::string constant;
  if (gyro.size() < kFewest) return constant;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double value = gyro.front().omega_gyro_rad_s[axis];
    if (std::all_of(gyro.begin(), gyro.end(), [&](const GyroSample& sample) {
          return sample.omega_gyro_rad_s[axis] == value;
        })) {
      constant += "xyz"[axis];
    }
  }
  return constant.size() == 3 ? std::string() : constant;
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_CONSTANT_AXES_H_
