#include "core/calibration.h"

#include "core/so3.h"

namespace camgyro {

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

Calibration Moved(Calibration c, const StateVector& d) {
  c.lens[kFocal] += d[kStateFocal];
  c.lens[kCx] += d[kStateCx];
  c.lens[kCy] += d[kStateCy];
  c.readout_s += d[kStateReadout];
  c.delay_s += d[kStateDelay];
  c.bias_gyro_rad_s += d.segment<3>(kStateBias);
  c.q_gyro_cam = c.q_gyro_cam * Exp(Eigen::Vector3d(d.segment<3>(kStateRotation)));
  return c;
}

StateVector ValuesOf(const Calibration& c, const Eigen::Quaterniond& q_reference) {
  Calibration zero;
  zero.q_gyro_cam = q_reference;
  return Difference(c, zero);
}

}  // namespace camgyro
