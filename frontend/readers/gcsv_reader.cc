#include "frontend/readers/gcsv_reader.h"

#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "frontend/readers/add_pictures.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/frame_order.h"
#include "frontend/readers/inside_folder.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sample_rows.h"
#include "frontend/readers/text.h"
#include "frontend/readers/whole_file.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

// The lines before the table: `key,value`.
struct GcsvHead {
  struct Entry {
    std::string value;
    int line = 0;
  };
  std::map<std::string, Entry> entries;
  int lines = 0;  // before the table's header
};

Result<GcsvHead> ReadHead(const std::string& file) {
  if (Status is_file = CheckIsFile(file); !is_file) return tl::unexpected(is_file.error());
  std::ifstream in(file, std::ios::binary);
  if (!in) return BadInput(Concat(file, ": cannot be opened for reading"));
  GcsvHead head;
  std::string line;
  while (std::getline(in, line)) {
    const std::string_view text = Trim(line);
    if (head.lines == 0 && text != "GYROFLOW IMU LOG" && text != "CAMERA IMU LOG") {
      return BadInput(Concat(file, ":1: '", text, "' was found, expected GYROFLOW IMU LOG"));
    }
    if (text.substr(0, 2) == "t,") return head;
    ++head.lines;
    const size_t comma = text.find(',');
    if (head.lines == 1 || text.empty()) continue;
    if (comma == std::string_view::npos) {
      return BadInput(
          Concat(file, ":", head.lines, ": '", text, "' was found, expected key,value"));
    }
    head.entries[std::string(Trim(text.substr(0, comma)))] = {
        std::string(Trim(text.substr(comma + 1))), head.lines};
  }
  return BadInput(Concat(file, ": ends after ", head.lines,
                         " lines, expected a table with the header t,gx,gy,gz"));
}

// A number of the head; `absent` is for keys that may be missing.
Result<double> HeadNumber(const std::string& file, const GcsvHead& head, const std::string& key,
                          std::optional<double> absent, bool positive = true) {
  const auto found = head.entries.find(key);
  if (found == head.entries.end()) {
    if (absent) return *absent;
    return BadInput(Concat(file, ": has no line ", key, ",NUMBER before its table"));
  }
  double value = 0.0;
  if (!ParseNumber(std::string_view(found->second.value), &value) || !std::isfinite(value) ||
      (positive && !(value > 0.0))) {
    return BadInput(Concat(file, ":", found->second.line, ": ", key, ": '", found->second.value,
                           "' was found, expected a number", positive ? " above zero" : ""));
  }
  return value;
}

// The matrix of "YxZ": component i is column |letter|, negative for small letters.
Result<Eigen::Matrix3d> Orientation(const std::string& file, const GcsvHead& head) {
  const auto found = head.entries.find("orientation");
  if (found == head.entries.end()) {
    return BadInput(Concat(file, ": has no line orientation,XYZ before its table"));
  }
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  const std::string& text = found->second.value;
  for (int i = 0; i < 3 && text.size() == 3; ++i) {
    const int column = std::toupper(static_cast<unsigned char>(text[i])) - 'X';
    if (column < 0 || column > 2) break;
    axes(i, column) = text[i] < 'a' ? 1.0 : -1.0;
  }
  if (std::abs(axes.determinant()) != 1.0) {
    return BadInput(Concat(file, ":", found->second.line, ": orientation: '", text,
                           "' was found, expected the letters x, y, z in any order, small for a "
                           "reversed axis"));
  }
  return axes;
}

Status ReadTable(const std::string& file, const GcsvHead& head, Recording* recording) {
  const auto axes = Orientation(file, head);
  if (!axes) return tl::unexpected(axes.error());
  CsvReader csv = CsvReader::ByName(file, head.lines);
  const bool with_accel = csv.HasColumn("ax");
  const auto tscale = HeadNumber(file, head, "tscale", std::nullopt);
  const auto gscale = HeadNumber(file, head, "gscale", std::nullopt);
  const auto ascale =
      HeadNumber(file, head, "ascale", with_accel ? std::nullopt : std::optional<double>(1.0));
  for (const auto* scale : {&tscale, &gscale, &ascale}) {
    if (!*scale) return tl::unexpected(scale->error());
  }
  SampleColumns columns;
  columns.time = csv.Column({"t"});
  columns.time_unit_s = *tscale;
  columns.gyro = VectorColumns({"gx", "gy", "gz"}, &csv);
  columns.gyro_map = *gscale * *axes;
  if (with_accel) columns.accel = VectorColumns({"ax", "ay", "az"}, &csv);
  columns.accel_map = *ascale * kStandardGravity * *axes;
  if (!csv.status()) return csv.status();
  return ReadGyroRows(file, columns, &csv, recording);
}

Result<std::string> FindVideo(const std::string& log, const GcsvHead& head) {
  const std::string folder = fs::path(log).parent_path().string();
  std::vector<fs::path> candidates;
  const auto named = head.entries.find("videofilename");
  if (named != head.entries.end()) {
    // A path of the machine that wrote the log says nothing here.
    const auto inside = PathInside(folder, named->second.value, log);
    if (inside) candidates.push_back(*inside);
  }
  for (const char* extension : {".mp4", ".MP4", ".mov", ".MOV"}) {
    candidates.push_back(fs::path(log).replace_extension(extension));
  }
  for (const fs::path& candidate : candidates) {
    if (fs::is_regular_file(candidate)) return candidate.string();
  }
  return BadInput(Concat(log, ": no video beside it, expected ", candidates.front().string()));
}

}  // namespace

bool IsGcsv(const std::string& path) {
  const fs::path file(path);
  return file.extension() == ".gcsv" ||
         fs::is_regular_file(fs::path(file).replace_extension(".gcsv"));
}

Result<Recording> ReadGcsv(const std::string& path) {
  const bool is_log = fs::path(path).extension() == ".gcsv";
  const std::string log = fs::path(path).replace_extension(".gcsv").string();
  const Result<GcsvHead> head = ReadHead(log);
  if (!head) return tl::unexpected(head.error());
  const Result<std::string> video = is_log ? FindVideo(log, *head) : path;
  if (!video) return tl::unexpected(video.error());

  Recording recording;
  recording.path = path;
  if (Status table = ReadTable(log, *head, &recording); !table) {
    return tl::unexpected(table.error());
  }
  if (Status pictures = AddVideo(*video, log, log, &recording); !pictures) {
    return tl::unexpected(pictures.error());
  }
  Status frames = CheckFrames(*video, recording.frames);
  if (frames) frames = FrameOrder().Mend(*video, &recording);
  if (!frames) return tl::unexpected(frames.error());

  const auto readout_ms = HeadNumber(log, *head, "frame_readout_time", 0.0, /*positive=*/false);
  const auto direction = HeadNumber(log, *head, "frame_readout_direction", 0.0, /*positive=*/false);
  if (!readout_ms) return tl::unexpected(readout_ms.error());
  if (!direction) return tl::unexpected(direction.error());
  if (*direction == 0.0 || *direction == 1.0) {
    if (*readout_ms != 0.0) {
      recording.camera.readout_s = (*direction == 0.0 ? 1e-3 : -1e-3) * *readout_ms;
    }
  } else {
    recording.notes.push_back(Concat(log, ": frame_readout_direction ", *direction,
                                     " (by columns) is not supported, ignored"));
  }
  recording.notes.push_back(Concat(log, ": gyro axes ", head->entries.at("orientation").value,
                                   "; frame stamps are the video's"));
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
