#include "tools/report/parameter_rows.h"

#include <algorithm>
#include <cmath>

#include "estimator/start/axis_permutation.h"

namespace camgyro {
Eigen::Matrix3d MountingPermutation(const Calibration& calibration) {
  return FindNearestPermutation(calibration.q_gyro_cam.toRotationMatrix()).P_gyro_cam;
}

std::vector<ParameterRow> ParameterRows(const Calibration& c, const Eigen::Matrix3d& permutation,
                                        bool attitudes) {
  const StateVector values = ValuesOf(c, Eigen::Quaterniond(permutation));
  const StateVector sigma = c.sigma();
  const std::optional<StateVector> total = c.sigma_total();
  std::vector<ParameterRow> rows;
  for (int i = 0; i < kStateSize; ++i) {
    const StateParameter& p = StateTable()[static_cast<size_t>(i)];
    if (attitudes && p.needs_pixels) continue;
    // An attitude has no rows.
    const bool delay = attitudes && i == kStateDelay;
    ParameterRow row;
    row.name = delay ? "delay" : p.label;
    row.index = i;
    row.value = p.unit_scale * values[i];
    row.sigma = p.unit_scale * sigma[i];
    if (total) row.sigma_total = p.unit_scale * (*total)[i];
    row.unit_scale = p.unit_scale;
    row.unit = p.unit;
    row.determined = c.determined[static_cast<size_t>(i)];
    rows.push_back(row);
  }
  return rows;
}

ReadableUnit ReadableUnitOf(const std::string& unit) {
  if (unit == "s") return {1e3, "ms"};
  if (unit == "s^2") return {1e6, "ms^2"};
  return {1.0, unit};
}

std::string NameWithShape(const EffectSet::Item& item) {
  return item.entry->name + (item.entry->shape_by_fit ? " (" + item.shape + ")" : "");
}

int DecimalsFor(double sigma) {
  if (!(sigma > 0.0)) return 6;
  return std::min(6, std::max(0, 1 - static_cast<int>(std::floor(std::log10(sigma)))));
}

}  // namespace camgyro
