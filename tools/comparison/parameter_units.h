// How parameters are shown to people.
#ifndef CAMGYRO_TOOLS_COMPARISON_PARAMETER_UNITS_H_
#define CAMGYRO_TOOLS_COMPARISON_PARAMETER_UNITS_H_

#include <array>

#include "core/calibration.h"

namespace camgyro::comparison {

struct ParameterUnit {
  const char* label;
  const char* unit;
  double scale;  // shown = value * scale
};

// In the order of StateIndex.
inline const std::array<ParameterUnit, kStateSize>& ParameterUnits() {
  static const std::array<ParameterUnit, kStateSize> units = {{{"f", "px", 1.0},
                                                               {"c_x", "px", 1.0},
                                                               {"c_y", "px", 1.0},
                                                               {"t_r", "ms", 1e3},
                                                               {"t_d", "ms", 1e3},
                                                               {"b_x", "mrad/s", 1e3},
                                                               {"b_y", "mrad/s", 1e3},
                                                               {"b_z", "mrad/s", 1e3},
                                                               {"q_x", "mrad", 1e3},
                                                               {"q_y", "mrad", 1e3},
                                                               {"q_z", "mrad", 1e3}}};
  return units;
}

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_PARAMETER_UNITS_H_
