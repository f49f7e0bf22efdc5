// Folders of VideoIMUCapture (github.com/DavidGillsjo/VideoIMUCapture-Android). Of builds
// that have protobuf: see formats.cc.
#ifndef CAMGYRO_FRONTEND_READERS_VIDEO_IMU_CAPTURE_READER_H_
#define CAMGYRO_FRONTEND_READERS_VIDEO_IMU_CAPTURE_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

//   video_meta.pb3       gyro, accelerometer, and stamp, exposure, readout of numbered pictures
//   video_recording.mp4  the pictures
// A picture that video_meta.pb3 does not number gets the container's stamp, moved to the other
// clock as its fellows are (noted). Initial guesses: focal length and readout, medians. Declared
// stabilisation is taken. Errors name the record and its byte in the file.
Result<Recording> ReadVideoImuCapture(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_VIDEO_IMU_CAPTURE_READER_H_
