// Folders of OpenCamera Sensors (github.com/MobileRoboticsSkoltech/OpenCamera-Sensors).
#ifndef CAMGYRO_FRONTEND_READERS_OPEN_CAMERA_READER_H_
#define CAMGYRO_FRONTEND_READERS_OPEN_CAMERA_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True if the folder holds a VIDEO_gyro.csv or VIDEOgyro.csv and the VIDEO_timestamps.csv to it.
bool IsOpenCamera(const std::string& folder);

//   VIDEO_gyro.csv, VIDEO_accel.csv   x,y,z,timestamp [ns], without a header; rad/s and m/s^2
//   VIDEO_timestamps.csv              timestamp [ns] of each picture
//   VIDEO.mp4                         in the folder, or beside it as the app writes it
// Errors as ReadRecording.
Result<Recording> ReadOpenCamera(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_OPEN_CAMERA_READER_H_
