#include "core/saturation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace camgyro {

std::vector<bool> FindSaturated(const std::vector<GyroSample>& gyro) {
  std::vector<bool> saturated(gyro.size(), false);
  // Largest value of each axis and sign, and those of them that are rails.
  std::array<double, 6> largest{};
  std::array<bool, 6> is_rail{};
  const auto value = [&](const GyroSample& sample, size_t k) {
    return (k < 3 ? 1.0 : -1.0) * sample.omega_gyro_rad_s[static_cast<Eigen::Index>(k % 3)];
  };
  for (size_t k = 0; k < 6; ++k) {
    for (const GyroSample& sample : gyro) largest[k] = std::max(largest[k], value(sample, k));
    int at = 0, below = 0;
    for (const GyroSample& sample : gyro) {
      const double share = value(sample, k) / largest[k];
      at += share > 1.0 - 1e-6 ? 1 : 0;
      below += share > 0.97 && share <= 1.0 - 1e-6 ? 1 : 0;
    }
    is_rail[k] = largest[k] > 0.5 && at >= 5 && at >= 2 * below;
  }
  for (size_t k = 0; k < 6; ++k) {
    // The rail of another axis counts where this one reaches it, too.
    const bool counts = std::any_of(is_rail.begin(), is_rail.end(), [&](const bool& rail) {
      const double limit = largest[static_cast<size_t>(&rail - is_rail.data())];
      return rail && std::abs(largest[k] - limit) < 1e-6 * limit;
    });
    if (!counts) continue;
    for (size_t i = 0; i < gyro.size(); ++i) {
      if (value(gyro[i], k) > (1.0 - 1e-6) * largest[k]) saturated[i] = true;
    }
  }
  return saturated;
}

}  // namespace camgyro
