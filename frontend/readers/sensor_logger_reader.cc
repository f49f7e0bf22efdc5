#include "frontend/readers/sensor_logger_reader.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "frontend/readers/add_pictures.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/frame_order.h"
#include "frontend/readers/image_file.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sample_rows.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kNsPerMs = 1000000;

// The uncalibrated log is preferred: the phone changes the bias in the other one as it pleases.
std::string GyroFile(const std::string& folder) {
  for (const char* name : {"GyroscopeUncalibrated.csv", "Gyroscope.csv"}) {
    const fs::path file = fs::path(folder) / name;
    if (fs::is_regular_file(file)) return file.string();
  }
  return "";
}

Status ReadSensorLoggerGyro(const std::string& file, Recording* recording) {
  CsvReader csv = CsvReader::ByName(file);
  SampleColumns columns;
  columns.time = csv.Column({"time"});
  columns.gyro = VectorColumns({"x", "y", "z"}, &csv);
  if (!csv.status()) return csv.status();
  return ReadGyroRows(file, columns, &csv, recording);
}

Status ReadSensorLoggerAccel(const std::string& file, Recording* recording) {
  CsvReader csv = CsvReader::ByName(file);
  SampleColumns columns;
  columns.time = csv.Column({"time"});
  columns.accel = VectorColumns({"x", "y", "z"}, &csv);
  return ReadAccelRows(file, columns, &csv, recording);
}

// Files of Camera/ whose name is a number of milliseconds, by that number.
std::vector<std::pair<int64_t, std::string>> StampedFiles(const fs::path& folder,
                                                          const std::string& extension) {
  std::vector<std::pair<int64_t, std::string>> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    int64_t stamp_ms = 0;
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == extension && ParseNumber(std::string_view(name), &stamp_ms)) {
      files.emplace_back(stamp_ms * kNsPerMs, entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

Status AddCamera(const std::string& folder, Recording* recording) {
  const fs::path camera = fs::path(folder) / "Camera";
  const auto images = StampedFiles(camera, ".jpg");
  const auto videos = StampedFiles(camera, ".mp4");
  if (images.empty() == videos.empty() || videos.size() > 1) {
    return BadInput(Concat(camera.string(), ": has ", images.size(), " images and ", videos.size(),
                           " videos named by milliseconds, expected images or one video"));
  }
  if (!videos.empty()) {
    const auto& [start_ns, video] = videos.front();
    if (Status status = AddVideo(video, video, video, recording); !status) return status;
    for (Frame& frame : recording->frames) frame.stamp_ns += start_ns;
    recording->notes.push_back(
        Concat(video,
               ": frame stamps are the video's, from the time in its name, which the app "
               "takes some tenths of a second before the first picture"));
    return {};
  }
  for (const auto& [stamp_ns, image] : images) {
    Frame frame;
    frame.stamp_ns = stamp_ns;
    frame.image_file = image;
    recording->frames.push_back(frame);
  }
  recording->notes.push_back(Concat(camera.string(), ": stamps of images are whole milliseconds"));
  const std::string& first = images.front().second;
  const Result<cv::Mat> image = ReadGrayImage(first);
  if (!image) return tl::unexpected(image.error());
  return SetResolution(image->cols, image->rows, first, first, &recording->camera);
}

}  // namespace

bool IsSensorLogger(const std::string& folder) { return !GyroFile(folder).empty(); }

Result<Recording> ReadSensorLogger(const std::string& folder) {
  Recording recording;
  recording.path = folder;
  Status status = ReadSensorLoggerGyro(GyroFile(folder), &recording);
  const fs::path accel = fs::path(folder) / "TotalAcceleration.csv";
  if (status && fs::is_regular_file(accel))
    status = ReadSensorLoggerAccel(accel.string(), &recording);
  if (status) status = AddCamera(folder, &recording);
  if (status) status = CheckFrames(folder, recording.frames);
  if (status) status = FrameOrder().Mend((fs::path(folder) / "Camera").string(), &recording);
  if (!status) return tl::unexpected(status.error());
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
