#include "frontend/readers/read_recording.h"

#include <filesystem>

#include "frontend/gyro_spikes.h"
#include "frontend/readers/formats.h"
#include "frontend/readers/text.h"
#include "frontend/stamp_clock.h"

namespace camgyro {
namespace {

Result<Recording> ReadAsRecorded(const std::string& path) {
  namespace fs = std::filesystem;
  try {
    if (!fs::exists(path)) {
      return BadInput(Concat(path,
                             ": does not exist; expected a recording "
                             "(docs/recording_format.md): ",
                             ListFormats()));
    }
    const RecordingFormat* format = FindFormat(path);
    if (format == nullptr) {
      return BadInput(Concat(path,
                             ": not a recording of a known format (docs/recording_format.md), "
                             "which are ",
                             ListFormats()));
    }
    if (Status built = CheckBuilt(*format, path); !built) return tl::unexpected(built.error());
    return format->read(path);
  } catch (const fs::filesystem_error& error) {  // of folders that may not be read
    return BadInput(Concat(path, ": ", error.code().message()));
  }
}

}  // namespace

Result<Recording> ReadRecording(const std::string& path, const ReadOptions& options) {
  Result<Recording> recording = ReadAsRecorded(path);
  if (!recording) return recording;
  RepairStamps(options.stamps, &*recording);
  MendSpikes(&*recording);
  // Of an hour, these have grown to 10 MB more than they hold.
  recording->gyro.shrink_to_fit();
  recording->accel.shrink_to_fit();
  if (options.strict && !recording->faults.empty()) {
    return BadInput("with strict reading: " + recording->faults.front().finding);
  }
  if (options.strict && recording->gyro_stamps->repaired) {
    return BadInput(Concat(path, ": with strict reading: gyro stamps are ",
                           DescribeStamps(*recording->gyro_stamps),
                           "; read stamps as recorded to use them so"));
  }
  return recording;
}

}  // namespace camgyro
