#include "frontend/readers/read_recording.h"

#include <filesystem>

#include "frontend/readers/folder_reader.h"
#include "frontend/readers/gopro_reader.h"
#include "frontend/readers/text.h"

namespace camgyro {

Result<Recording> ReadRecording(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return BadInput(Concat(path, ": does not exist; expected a recording folder or a GoPro MP4"));
  }
  return std::filesystem::is_directory(status) ? ReadFolder(path) : ReadGoPro(path);
}

}  // namespace camgyro
