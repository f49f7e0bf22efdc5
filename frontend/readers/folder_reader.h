// Reader of a recording folder (docs/recording_format.md; the EuRoC/ASL layout).
#ifndef CAMGYRO_FRONTEND_READERS_FOLDER_READER_H_
#define CAMGYRO_FRONTEND_READERS_FOLDER_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// folder: the one that holds cam0/ and imu0/, or mav0/ with them inside. Errors as ReadRecording.
Result<Recording> ReadFolder(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_FOLDER_READER_H_
