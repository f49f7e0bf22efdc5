// Folders of VideoIMUCapture (github.com/DavidGillsjo/VideoIMUCapture-Android). Needs protobuf: the
// build has it or has not.
#ifndef CAMGYRO_FRONTEND_READERS_VIDEO_IMU_CAPTURE_READER_H_
#define CAMGYRO_FRONTEND_READERS_VIDEO_IMU_CAPTURE_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True if the folder holds video_meta.pb3.
bool IsVideoImuCapture(const std::string& folder);

//   video_meta.pb3       gyro, accelerometer, and stamp, exposure, readout of numbered pictures
//   video_recording.mp4  the pictures
// A picture that video_meta.pb3 does not number gets the container's stamp, moved to the other
// clock as its fellows are (noted). Initial guesses: focal length and readout, medians. Declared
// stabilisation is taken. Errors name the record and its byte in the file; and one says so if this
// build is without protobuf.
Result<Recording> ReadVideoImuCapture(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_VIDEO_IMU_CAPTURE_READER_H_
