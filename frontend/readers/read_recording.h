// The one entrance to files: finds the reader for what the user named, and reads it.
#ifndef CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_
#define CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/readers/repair_stamps.h"

namespace camgyro {

struct ReadOptions {
  StampsMode stamps = StampsMode::kAuto;
  bool strict = false;  // an error instead of any repair of the data
};

// Reads a recording in any format of docs/recording_format.md; formats.h has the table of them.
// Images are not decoded here (see frame_source.h). Every complaint names the file, the line, and
// what was expected there. What is out of order in the samples is mended as far as that is safe,
// and named in the recording's faults and notes; arrival times are replaced by the sampling clock
// behind them (repair_stamps.h).
Result<Recording> ReadRecording(const std::string& path, const ReadOptions& options = {});

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_READ_RECORDING_H_
