#include "frontend/readers/read_recording.h"

#include <filesystem>

#include "frontend/readers/folder_reader.h"
#include "frontend/readers/gcsv_reader.h"
#include "frontend/readers/gopro_reader.h"
#include "frontend/readers/mars_logger_reader.h"
#include "frontend/readers/open_camera_reader.h"
#include "frontend/readers/rosbag_reader.h"
#include "frontend/readers/sensor_logger_reader.h"
#include "frontend/readers/text.h"
#include "frontend/readers/video_imu_capture_reader.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

// A logger's folder is known by the files in it; ours comes first, and last for its complaint.
Result<Recording> ReadAnyFolder(const std::string& folder) {
  const fs::path root(folder);
  if (fs::is_directory(root / "cam0") || fs::is_directory(root / "mav0")) return ReadFolder(folder);
  if (IsVideoImuCapture(folder)) return ReadVideoImuCapture(folder);
  if (IsMarsLogger(folder)) return ReadMarsLogger(folder);
  if (IsSensorLogger(folder)) return ReadSensorLogger(folder);
  if (IsOpenCamera(folder)) return ReadOpenCamera(folder);
  return ReadFolder(folder);
}

}  // namespace

Result<Recording> ReadRecording(const std::string& path) {
  try {
    if (!fs::exists(path)) {
      return BadInput(Concat(path,
                             ": does not exist; expected a recording (docs/recording_format.md): a "
                             "folder, a GoPro MP4, a .gcsv or a ROS bag"));
    }
    if (fs::is_directory(path)) return ReadAnyFolder(path);
    if (IsRosbag(path)) return ReadRosbag(path);
    return IsGcsv(path) ? ReadGcsv(path) : ReadGoPro(path);
  } catch (const fs::filesystem_error& error) {  // of folders that may not be read
    return BadInput(Concat(path, ": ", error.code().message()));
  }
}

}  // namespace camgyro
