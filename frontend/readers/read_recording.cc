#include "frontend/readers/read_recording.h"

#include <filesystem>

#include "frontend/readers/folder_reader.h"
#include "frontend/readers/formats.h"
#include "frontend/readers/text.h"

namespace camgyro {

Result<Recording> ReadRecording(const std::string& path) {
  namespace fs = std::filesystem;
  try {
    if (!fs::exists(path)) {
      return BadInput(Concat(path,
                             ": does not exist; expected a recording "
                             "(docs/recording_format.md): ",
                             ListFormats()));
    }
    const RecordingFormat* format = FindFormat(path);
    if (format == nullptr) return ReadFolder(path);  // for its complaint
    if (Status built = CheckBuilt(*format, path); !built) return tl::unexpected(built.error());
    return format->read(path);
  } catch (const fs::filesystem_error& error) {  // of folders that may not be read
    return BadInput(Concat(path, ": ", error.code().message()));
  }
}

}  // namespace camgyro
