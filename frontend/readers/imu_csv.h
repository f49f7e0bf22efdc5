// imu0/data.csv: #timestamp [ns],w_x,w_y,w_z [rad s^-1][,a_x,a_y,a_z [m s^-2]]
#ifndef CAMGYRO_FRONTEND_READERS_IMU_CSV_H_
#define CAMGYRO_FRONTEND_READERS_IMU_CSV_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Fills gyro, accel and notes of the recording. Rates are converted to rad/s if the header says
// deg; rows that repeat the one before them exactly are dropped; both are noted. Refused: rates
// that no gyro can have measured in rad/s, stamps that repeat with other values or go back, fewer
// than two samples, stamps that cannot be nanoseconds.
Status ReadImuCsv(const std::string& file, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_IMU_CSV_H_
