#include "frontend/readers/read_recording.h"

#include <filesystem>

#include "frontend/readers/folder_reader.h"
#include "frontend/readers/text.h"

namespace camgyro {

Result<Recording> ReadRecording(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) {
    return BadInput(Concat(path, ": is not a folder; expected a recording folder"));
  }
  return ReadFolder(path);
}

}  // namespace camgyro
