#include "frontend/readers/open_camera_reader.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <vector>

#include "frontend/readers/add_pictures.h"
#include "frontend/readers/camera_csv.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sample_rows.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

// The three logs of one video; accel may be empty.
struct Logs {
  std::string video_name;  // without extension
  std::string gyro, accel, stamps;
};

std::string Existing(const fs::path& file) {
  return fs::is_regular_file(file) ? file.string() : std::string();
}

// Of the first video, by name, whose gyro log and stamps are there.
std::optional<Logs> FindLogs(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  const fs::path root(folder);
  for (const std::string& name : names) {
    for (const std::string separator : {"_", ""}) {
      const std::string ending = separator + "gyro.csv";
      if (name.size() <= ending.size() ||
          name.compare(name.size() - ending.size(), ending.size(), ending) != 0) {
        continue;
      }
      Logs logs;
      logs.video_name = name.substr(0, name.size() - ending.size());
      logs.gyro = (root / name).string();
      logs.accel = Existing(root / (logs.video_name + separator + "accel.csv"));
      logs.stamps = Existing(root / (logs.video_name + "_timestamps.csv"));
      if (!logs.stamps.empty()) return logs;
    }
  }
  return std::nullopt;
}

Status ReadOpenCameraGyro(const std::string& file, Recording* recording) {
  CsvReader csv(file, {"x [rad/s]", "y [rad/s]", "z [rad/s]", "timestamp [ns]"}, {4});
  SampleColumns columns;
  columns.time = 3;
  columns.gyro = {0, 1, 2};
  return ReadGyroRows(file, columns, &csv, recording);
}

Status ReadOpenCameraAccel(const std::string& file, Recording* recording) {
  CsvReader csv(file, {"x [m/s^2]", "y [m/s^2]", "z [m/s^2]", "timestamp [ns]"}, {4});
  SampleColumns columns;
  columns.time = 3;
  columns.accel = {0, 1, 2};
  return ReadAccelRows(file, columns, &csv, recording);
}

}  // namespace

bool IsOpenCamera(const std::string& folder) { return FindLogs(folder).has_value(); }

Result<Recording> ReadOpenCamera(const std::string& folder) {
  const std::optional<Logs> logs = FindLogs(folder);
  if (!logs) return BadInput(Concat(folder, ": no logs of OpenCamera Sensors"));
  const std::string video_file = logs->video_name + ".mp4";
  std::string video = Existing(fs::path(folder) / video_file);
  if (video.empty()) video = Existing(fs::absolute(folder) / ".." / video_file);
  if (video.empty()) {
    return BadInput(Concat(folder, ": has logs of OpenCamera Sensors, but no ", video_file,
                           " in it or beside it"));
  }
  Recording recording;
  recording.path = folder;
  Status status = ReadOpenCameraGyro(logs->gyro, &recording);
  if (status && !logs->accel.empty()) status = ReadOpenCameraAccel(logs->accel, &recording);
  if (!status) return tl::unexpected(status.error());
  Result<FrameTable> table = ReadFrameTable(logs->stamps);
  if (!table) return tl::unexpected(table.error());
  recording.frames = std::move(table->frames);
  status = CheckFrames(logs->stamps, recording.frames);
  if (status) status = AddVideo(video, logs->stamps, logs->stamps, &recording);
  if (status) status = table->order.Mend(logs->stamps, &recording);
  if (!status) return tl::unexpected(status.error());
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
