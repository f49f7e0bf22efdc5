// Folders of ios_logger for iPhones (github.com/Varvrar/ios_logger).
#ifndef CAMGYRO_FRONTEND_READERS_IOS_LOGGER_READER_H_
#define CAMGYRO_FRONTEND_READERS_IOS_LOGGER_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True if the folder holds Gyro.txt, and Frames.txt or ARposes.txt.
bool IsIosLogger(const std::string& folder);

// Tables without headers:
//   Gyro.txt     time [s since 1970], x, y, z [rad/s]
//   Accel.txt    time [s], x, y, z [g], pointing as gravity does (Apple's sign); optional
//   Frames.txt   time [s], number[, fx, fy, cx, cy]: one row per picture; medians are the guess
//   Frames.m4v   the pictures
//   ARposes.txt  time [s], x, y, z, qw, qx, qy, qz (camera -> world): used without Frames.m4v
// Errors as ReadRecording.
Result<Recording> ReadIosLogger(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_IOS_LOGGER_READER_H_
