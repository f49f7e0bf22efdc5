// In place of video_imu_capture_reader.cc where the build has no protobuf.
#include <filesystem>

#include "frontend/readers/video_imu_capture_reader.h"

namespace camgyro {

bool IsVideoImuCapture(const std::string& folder) {
  return std::filesystem::is_regular_file(std::filesystem::path(folder) / "video_meta.pb3");
}

Result<Recording> ReadVideoImuCapture(const std::string& folder) {
  return BadInput(
      folder +
      ": a recording of VideoIMUCapture; this camgyro was built without protobuf, which "
      "reading it needs (libprotobuf-dev and protobuf-compiler)");
}

}  // namespace camgyro
