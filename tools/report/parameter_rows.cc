#include "tools/report/parameter_rows.h"

#include <algorithm>
#include <cmath>

#include "core/so3.h"
#include "estimator/start/axis_permutation.h"

namespace camgyro {
namespace {

constexpr double kDegrees = 57.29577951308232;

}  // namespace

Eigen::Matrix3d MountingPermutation(const Calibration& calibration) {
  return FindNearestPermutation(calibration.q_gyro_cam.toRotationMatrix()).P_gyro_cam;
}

std::vector<ParameterRow> ParameterRows(const Calibration& c, const Eigen::Matrix3d& permutation,
                                        bool attitudes) {
  const Eigen::Quaterniond q_permutation(permutation);
  const Eigen::Vector3d turn = Log<double>(q_permutation.conjugate() * c.q_gyro_cam);
  const Eigen::Vector3d& bias = c.bias_gyro_rad_s;
  const StateVector sigma = c.sigma();
  std::vector<ParameterRow> rows;
  const auto add = [&](const char* name, int index, double value, double scale, const char* unit) {
    if (attitudes && index <= kStateReadout) return;
    rows.push_back({name, index, scale * value, scale * sigma[index], scale, unit,
                    c.determined[static_cast<size_t>(index)]});
  };
  add("focal length", kStateFocal, c.lens[kFocal], 1.0, "px");
  add("principal point x", kStateCx, c.lens[kCx], 1.0, "px");
  add("principal point y", kStateCy, c.lens[kCy], 1.0, "px");
  add("readout time", kStateReadout, c.readout_s, 1e3, "ms");
  add(attitudes ? "delay" : "delay of row 0", kStateDelay, c.delay_s, 1e3, "ms");
  add("gyro bias x", kStateBias, bias.x(), kDegrees, "deg/s");
  add("gyro bias y", kStateBias + 1, bias.y(), kDegrees, "deg/s");
  add("gyro bias z", kStateBias + 2, bias.z(), kDegrees, "deg/s");
  add("mounting, about x", kStateRotation, turn.x(), kDegrees, "deg");
  add("mounting, about y", kStateRotation + 1, turn.y(), kDegrees, "deg");
  add("mounting, about z", kStateRotation + 2, turn.z(), kDegrees, "deg");
  return rows;
}

int DecimalsFor(double sigma) {
  if (!(sigma > 0.0)) return 6;
  return std::min(6, std::max(0, 1 - static_cast<int>(std::floor(std::log10(sigma)))));
}

}  // namespace camgyro
