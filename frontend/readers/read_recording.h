// The one entrance to files: finds the reader for what the user named, and reads it.
#ifndef CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_
#define CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Reads a recording in any format of docs/recording_format.md; formats.h has the table of them.
// Images are not decoded here (see frame_source.h). Every complaint names the file, the line, and
// what was expected there.
Result<Recording> ReadRecording(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_
