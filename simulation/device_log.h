// What a device logged of itself, in place of what a simulation would make up: how it turned, when
// its samples and pictures were taken, where its stabiliser held the lens.
#ifndef CAMGYRO_SIMULATION_DEVICE_LOG_H_
#define CAMGYRO_SIMULATION_DEVICE_LOG_H_

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"

namespace camgyro::simulation {

// Files of a log, csv with a header; empty: not of the log. Stamps are in columns timestamp_ns, or
// timestamp_s for seconds after the first gyro sample.
struct DeviceLogFiles {
  std::string gyro;    // and wx, wy, wz [rad/s]
  std::string frames;  // and, if known, exposure_s
  // And ois_x, ois_y: shift of the picture to the right and down, in units of their own. Logs that
  // are written frame by frame hold samples twice, and out of order: they are put in order.
  std::string lens_shift;
};

// Times are nanoseconds after the first gyro sample, and increase.
struct DeviceLog {
  std::vector<int64_t> gyro_ns;
  Eigen::Matrix3Xd rate_gyro_rad_s;  // gyro frame
  std::vector<int64_t> frame_ns;     // on the camera's clock
  std::vector<double> exposure_s;    // of the frames; empty: not known
  std::vector<int64_t> lens_ns;
  Eigen::Matrix2Xd lens_shift;

  // What lies between two lens samples is on a straight line; beyond the ends they are held.
  Eigen::Vector2d LensShiftAt(double time_s) const;
};

// Errors: a file that cannot be read, lacks a column, or has fewer than 20 rows (with its name and
// line); gyro or frame stamps that do not increase; frames or lens without a gyro.
Result<DeviceLog> ReadDeviceLog(const DeviceLogFiles& files);

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_DEVICE_LOG_H_
