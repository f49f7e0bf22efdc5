#include "core/calibration.h"

#include "core/so3.h"

namespace camgyro {

const std::array<std::string, kStateSize>& StateNames() {
  static const std::array<std::string, kStateSize> names = {
      "focal_px", "cx_px",  "cy_px", "readout_s", "delay_s", "bias_x",
      "bias_y",   "bias_z", "q_x",   "q_y",       "q_z"};
  return names;
}

StateVector Difference(const Calibration& a, const Calibration& b) {
  StateVector d;
  d[kStateFocal] = a.lens[kFocal] - b.lens[kFocal];
  d[kStateCx] = a.lens[kCx] - b.lens[kCx];
  d[kStateCy] = a.lens[kCy] - b.lens[kCy];
  d[kStateReadout] = a.readout_s - b.readout_s;
  d[kStateDelay] = a.delay_s - b.delay_s;
  d.segment<3>(kStateBias) = a.bias_gyro_rad_s - b.bias_gyro_rad_s;
  d.segment<3>(kStateRotation) = Log(Eigen::Quaterniond(b.q_gyro_cam.conjugate() * a.q_gyro_cam));
  return d;
}

}  // namespace camgyro
