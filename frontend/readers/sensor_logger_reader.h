// Folders of Sensor Logger (github.com/tszheichoi/awesome-sensor-logger): its zip, unpacked.
#ifndef CAMGYRO_FRONTEND_READERS_SENSOR_LOGGER_READER_H_
#define CAMGYRO_FRONTEND_READERS_SENSOR_LOGGER_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True if the folder holds Gyroscope.csv or GyroscopeUncalibrated.csv.
bool IsSensorLogger(const std::string& folder);

//   GyroscopeUncalibrated.csv, else Gyroscope.csv   time [ns since 1970], z, y, x [rad/s], by name
//   TotalAcceleration.csv                           time, z, y, x [m/s^2], gravity included
//   (Android) Camera/MILLISECONDS.jpg                         one per picture, or
//   Camera/MILLISECONDS.mp4                         one video; the name is when recording began,
//                                                   some tenths of a second before its first
//                                                   picture
// Errors as ReadRecording.
Result<Recording> ReadSensorLogger(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_SENSOR_LOGGER_READER_H_
