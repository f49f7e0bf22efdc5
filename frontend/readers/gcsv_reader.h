// Gyroflow's .gcsv beside a video (docs.gyroflow.xyz/app/technical-details/gcsv-format).
#ifndef CAMGYRO_FRONTEND_READERS_GCSV_READER_H_
#define CAMGYRO_FRONTEND_READERS_GCSV_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True for X.gcsv, and for a video X.* with X.gcsv beside it.
bool IsGcsv(const std::string& path);

// The log and the video: the file that was named, the log's `videofilename`, or X.mp4 or X.mov
// beside X.gcsv. Frames have the container's stamps. Rates and specific force are in the axes that
// the log's `orientation` maps to; `frame_readout_time` is the initial readout. Errors: a missing
// or unknown key, a row that is cut short, no video.
Result<Recording> ReadGcsv(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_GCSV_READER_H_
