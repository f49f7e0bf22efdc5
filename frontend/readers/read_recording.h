// The one entrance to files: finds the reader for what the user named, and reads it.
#ifndef CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_
#define CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Reads a recording in any layout of docs/recording_format.md: a folder (EuRoC/ASL, with or without
// mav0/), a GoPro MP4 with GPMF telemetry inside, a .gcsv with its video, the folder of a logger
// for phones, or a ROS bag. Images are not decoded here (see frame_source.h). Every complaint names
// the file, the line, and what was expected there.
Result<Recording> ReadRecording(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_
