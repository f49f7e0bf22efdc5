#include "core/saturation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace camgyro {
namespace {

// Relative to the largest of them, values are the same.
constexpr double kSame = 1e-6;

// The step in which an axis of the gyro is written down: the smallest difference of its values.
double StepOf(const std::vector<GyroSample>& gyro, Eigen::Index axis, double largest) {
  std::vector<double> values;
  values.reserve(gyro.size());
  for (const GyroSample& sample : gyro) values.push_back(sample.omega_gyro_rad_s[axis]);
  std::sort(values.begin(), values.end());
  double step = largest;
  for (size_t i = 1; i < values.size(); ++i) {
    const double difference = values[i] - values[i - 1];
    if (difference > kSame * largest) step = std::min(step, difference);
  }
  return step;
}

}  // namespace

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
    if (!(largest[k] > 0.5)) continue;
    // Where values have coarse steps, a turn stays at its peak for some samples, too: as long as in
    // the three steps below.
    constexpr double kSteps = 3.5;
    const double near = std::max(
        0.03 * largest[k], kSteps * StepOf(gyro, static_cast<Eigen::Index>(k % 3), largest[k]));
    int at = 0, below = 0;
    for (const GyroSample& sample : gyro) {
      const double under = largest[k] - value(sample, k);
      at += under < kSame * largest[k] ? 1 : 0;
      below += under >= kSame * largest[k] && under < near ? 1 : 0;
    }
    is_rail[k] = at >= 5 && at >= 2 * below;
  }
  for (size_t k = 0; k < 6; ++k) {
    // The rail of another axis counts where this one reaches it, too.
    const bool counts = std::any_of(is_rail.begin(), is_rail.end(), [&](const bool& rail) {
      const double limit = largest[static_cast<size_t>(&rail - is_rail.data())];
      return rail && std::abs(largest[k] - limit) < kSame * limit;
    });
    if (!counts) continue;
    for (size_t i = 0; i < gyro.size(); ++i) {
      if (value(gyro[i], k) > (1.0 - kSame) * largest[k]) saturated[i] = true;
    }
  }
  return saturated;
}

}  // namespace camgyro
