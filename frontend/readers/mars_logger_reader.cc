#include "frontend/readers/mars_logger_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "core/robust_statistics.h"
#include "frontend/readers/add_pictures.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sample_rows.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kSameFrameNs = 10000;  // the video's stamps are rounded to microseconds

// The column of a time, and its unit by the name.
struct TimeColumn {
  size_t index = 0;
  double unit_s = 1e-9;
};

TimeColumn FindTime(const std::string& name, CsvReader* csv) {
  if (csv->HasColumn(name + "[sec]")) return {csv->Column({name + "[sec]"}), 1.0};
  return {csv->Column({name + "[nanosec]"}), 1e-9};
}

Status ReadImu(const std::string& file, Recording* recording) {
  CsvReader csv = CsvReader::ByName(file);
  const TimeColumn time = FindTime("Timestamp", &csv);
  SampleColumns columns;
  columns.time = time.index;
  columns.time_unit_s = time.unit_s;
  columns.gyro = VectorColumns({"gx[rad/s]", "gy[rad/s]", "gz[rad/s]"}, &csv);
  columns.accel = VectorColumns({"ax[m/s^2]", "ay[m/s^2]", "az[m/s^2]"}, &csv);
  if (!csv.status()) return csv.status();
  return ReadGyroRows(file, columns, &csv, recording);
}

// What a capture says; NaN where it says nothing ("null").
struct Capture {
  double exposure_s = 0.0, focal_px = 0.0, readout_s = 0.0;
};

// Also makes a frame of each.
Result<std::map<int64_t, Capture>> ReadCaptures(const std::string& file, FrameOrder* order,
                                                Recording* recording) {
  std::map<int64_t, Capture> captures;
  CsvReader csv = CsvReader::ByName(file);
  const TimeColumn time = FindTime("Timestamp", &csv);
  const size_t focal = csv.Column({"fy[px]"});
  const auto optional_column = [&](const std::vector<std::string>& names) {
    for (const std::string& name : names) {
      if (csv.HasColumn(name)) return std::optional<size_t>(csv.Column({name}));
    }
    return std::optional<size_t>();
  };
  const auto exposure =
      optional_column({"Exposure time[nanosec]", "exposure time[nanosec]", "Exposure[nanosec]"});
  const auto readout = optional_column({"Frame readout time[nanosec]", "Frame readout[nanosec]"});
  if (!csv.status()) return tl::unexpected(csv.status().error());
  const double nan = std::nan("");
  const auto number = [&](size_t column) {
    const std::string_view cell = csv.Cell(column);
    return cell.empty() || cell == "null" ? nan : csv.Number(column);
  };
  while (csv.NextRow()) {
    Capture capture;
    const int64_t stamp_ns = csv.Time(time.index, time.unit_s);
    capture.focal_px = number(focal);
    capture.exposure_s = exposure ? 1e-9 * number(*exposure) : nan;
    capture.readout_s = readout ? 1e-9 * number(*readout) : nan;
    captures.emplace(stamp_ns, capture);
    AddFrame(stamp_ns, csv, order, recording);
  }
  if (!csv.status()) return tl::unexpected(csv.status().error());
  return captures;
}

Status ReadFrameStamps(const std::string& file, FrameOrder* order, Recording* recording) {
  CsvReader csv = CsvReader::ByName(file);
  const TimeColumn time = FindTime("Frame timestamp", &csv);
  while (csv.NextRow()) AddFrame(csv.Time(time.index, time.unit_s), csv, order, recording);
  return csv.status();
}

// The capture of a frame: the nearest one, if it is the same within rounding.
const Capture* CaptureOf(const std::map<int64_t, Capture>& captures, int64_t stamp_ns) {
  const auto found = captures.lower_bound(stamp_ns - kSameFrameNs);
  if (found == captures.end() || found->first > stamp_ns + kSameFrameNs) return nullptr;
  return &found->second;
}

// The median of what is a number above zero.
std::optional<double> Median(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return !(v > 0.0); }),
               values.end());
  if (values.empty()) return std::nullopt;
  return MedianInPlace(&values);
}

void AddCaptures(const std::map<int64_t, Capture>& captures, Recording* recording) {
  std::vector<double> focal_px, readout_s;
  size_t without = 0;
  for (Frame& frame : recording->frames) {
    const Capture* capture = CaptureOf(captures, frame.stamp_ns);
    if (capture == nullptr) {
      ++without;
      continue;
    }
    frame.exposure_s = capture->exposure_s;
    focal_px.push_back(capture->focal_px);
    readout_s.push_back(capture->readout_s);
  }
  recording->camera.focal_px = Median(focal_px);
  recording->camera.readout_s = Median(readout_s);
  if (without > 0) {
    recording->notes.push_back(Concat("movie_metadata.csv: ", without, " of ",
                                      recording->frames.size(), " frames have no capture there"));
  }
}

}  // namespace

bool IsMarsLogger(const std::string& folder) {
  return fs::is_regular_file(fs::path(folder) / "gyro_accel.csv");
}

Result<Recording> ReadMarsLogger(const std::string& folder) {
  const auto existing = [&](const std::vector<const char*>& names) {
    for (const char* name : names) {
      if (fs::is_regular_file(fs::path(folder) / name)) {
        return (fs::path(folder) / name).string();
      }
    }
    return std::string();
  };
  const std::string video = existing({"movie.mp4", "movie.MP4", "movie.mov", "movie.MOV"});
  const std::string stamps = existing({"frame_timestamps.txt", "frame_timestamps.csv"});
  const std::string metadata = existing({"movie_metadata.csv"});
  if (video.empty()) {
    return BadInput(Concat(folder, ": has gyro_accel.csv of MARSLogger, but no movie.mp4"));
  }
  if (stamps.empty() && metadata.empty()) {
    return BadInput(Concat(folder,
                           ": has gyro_accel.csv of MARSLogger, but no stamps of frames; expected "
                           "frame_timestamps.txt or movie_metadata.csv"));
  }
  Recording recording;
  recording.path = folder;
  Status status = ReadImu((fs::path(folder) / "gyro_accel.csv").string(), &recording);
  std::map<int64_t, Capture> captures;
  FrameOrder order;
  if (status && !metadata.empty()) {
    auto read = ReadCaptures(metadata, &order, &recording);
    if (!read) return tl::unexpected(read.error());
    captures = std::move(*read);
  }
  if (status && !stamps.empty()) {
    recording.frames.clear();  // those of the captures, which may be more than the pictures
    order = {};
    status = ReadFrameStamps(stamps, &order, &recording);
  }
  const std::string& frames_file = stamps.empty() ? metadata : stamps;
  if (status) status = CheckFrames(frames_file, recording.frames);
  if (status) status = AddVideo(video, frames_file, frames_file, &recording);
  if (status) status = order.Mend(frames_file, &recording);
  if (!status) return tl::unexpected(status.error());
  if (!captures.empty()) AddCaptures(captures, &recording);
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
