#include "frontend/readers/recording_yaml_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/readers/add_pictures.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/formats.h"
#include "frontend/readers/image_file.h"
#include "frontend/readers/inside_folder.h"
#include "frontend/readers/lens_shift.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sample_rows.h"
#include "frontend/readers/sensor_yaml.h"
#include "frontend/readers/text.h"
#include "frontend/readers/yaml_keys.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

constexpr char kName[] = "recording.yaml";
constexpr double kRadPerDeg = M_PI / 180.0;
constexpr double kLargestOffsetS = 4e9;  // 126 years: clocks that count from different origins

using Units = std::map<std::string, double>;

// One section of recording.yaml (gyro, accel, camera, lens_shift, bag), with the look-ups that they
// share.
class Section {
 public:
  Section(const std::string& yaml, const YAML::Node& root, const std::string& name)
      : folder_(fs::path(yaml).parent_path().string()),
        yaml_(yaml),
        name_(name),
        is_there_(root[name].IsDefined()),
        keys_(yaml, is_there_ && root[name].IsMap() ? root[name] : YAML::Node()) {
    if (is_there_ && !root[name].IsMap()) {
      keys_.Fail(name, "expected lines of `key: value` below it");
    }
  }

  bool is_there() const { return is_there_; }
  YamlKeys& keys() { return keys_; }
  const Status& status() const { return keys_.status(); }

  // The path of the file that a key names; empty without the key.
  std::string File(const std::string& key) {
    const std::optional<std::string> name = keys_.Text(key);
    if (!name) return "";
    const auto path = PathInside(folder_, *name, Concat(yaml_, ": ", name_));
    if (path) return *path;
    keys_.Fail(key, Concat("'", *name, "', expected a file inside of the recording's folder"));
    return "";
  }

  double Unit(const std::string& key, const Units& units, const std::string& absent) {
    const std::string name = keys_.Text(key).value_or(absent);
    const auto found = units.find(name);
    if (found != units.end()) return found->second;
    std::string list;
    for (const auto& unit : units) list += (list.empty() ? "" : ", ") + unit.first;
    keys_.Fail(key, Concat("'", name, "' was found, expected one of ", list));
    return 1.0;
  }

  CsvReader Table(const std::string& file) {
    const std::string separator = keys_.Text("separator").value_or(",");
    if (separator.size() != 1) keys_.Fail("separator", "expected one character");
    return CsvReader::Described(file, separator.empty() ? ',' : separator.front());
  }

  // Sets where the time of a row is.
  void Time(CsvReader* csv, SampleColumns* columns) {
    const Units units = {{"ns", 1e-9}, {"us", 1e-6}, {"ms", 1e-3}, {"s", 1.0}};
    columns->time = Column(csv, "time");
    columns->time_unit_s = Unit("time_unit", units, "ns");
    const double offset_s = keys_.Number("time_offset_s").value_or(0.0);
    if (std::abs(offset_s) > kLargestOffsetS) keys_.Fail("time_offset_s", "expected seconds");
    columns->time_offset_ns = keys_.status() ? std::llround(offset_s * 1e9) : 0;
  }

  size_t Column(CsvReader* csv, const std::string& key) {
    const std::optional<std::string> name = keys_.Text(key);
    if (name) return csv->NamedOrNumbered(*name);
    keys_.Fail(key, Concat("is missing below `", name_, "`, expected the name of a column"));
    return 0;
  }

  std::array<size_t, 3> VectorColumns(CsvReader* csv) {
    return Columns<3>("[x, y, z], three names or numbers of columns", csv);
  }

  template <size_t kSize>
  std::array<size_t, kSize> Columns(const std::string& expected, CsvReader* csv) {
    const std::vector<std::string> names = keys_.Texts("columns", expected);
    std::array<size_t, kSize> columns = {};
    if (names.size() != kSize) keys_.Fail("columns", "expected " + expected);
    for (size_t i = 0; i < std::min(kSize, names.size()); ++i) {
      columns[i] = csv->NamedOrNumbered(names[i]);
    }
    return columns;
  }

  // The first thing that is wrong in the section or in its table.
  Status Check(const CsvReader& csv) const { return status() ? csv.status() : status(); }

 private:
  const std::string folder_, yaml_, name_;
  const bool is_there_;
  YamlKeys keys_;
};

Status ReadGyro(Section section, Recording* recording) {
  section.keys().AllowOnly(
      {"file", "separator", "time", "time_unit", "time_offset_s", "columns", "unit"});
  const std::string file = section.File("file");
  if (section.status() && file.empty()) section.keys().Fail("file", "is missing below `gyro`");
  if (!section.status()) return section.status();
  CsvReader csv = section.Table(file);
  SampleColumns columns;
  section.Time(&csv, &columns);
  columns.gyro = section.VectorColumns(&csv);
  columns.gyro_map *= section.Unit("unit", {{"rad/s", 1.0}, {"deg/s", kRadPerDeg}}, "rad/s");
  if (Status good = section.Check(csv); !good) return good;
  return ReadGyroRows(file, columns, &csv, recording);
}

Status ReadAccel(Section section, Recording* recording) {
  section.keys().AllowOnly(
      {"file", "separator", "time", "time_unit", "time_offset_s", "columns", "unit"});
  const std::string file = section.File("file");
  if (section.status() && file.empty()) section.keys().Fail("file", "is missing below `accel`");
  if (!section.status()) return section.status();
  CsvReader csv = section.Table(file);
  SampleColumns columns;
  section.Time(&csv, &columns);
  columns.accel = section.VectorColumns(&csv);
  columns.accel_map *= section.Unit(
      "unit",
      {{"m/s^2", 1.0}, {"g", kStandardGravity}, {"-m/s^2", -1.0}, {"-g", -kStandardGravity}},
      "m/s^2");
  if (Status good = section.Check(csv); !good) return good;
  return ReadAccelRows(file, columns, &csv, recording);
}

// The rows of the camera's table: stamps, names of images in `images`, exposures.
Status ReadFrames(const std::string& file, const std::string& images, Section* section,
                  FrameOrder* order, Recording* recording) {
  CsvReader csv = section->Table(file);
  SampleColumns columns;
  section->Time(&csv, &columns);
  const bool has_exposure = section->keys().Text("exposure").has_value();
  const size_t exposure = has_exposure ? section->Column(&csv, "exposure") : 0;
  const double exposure_unit_s =
      section->Unit("exposure_unit", {{"ns", 1e-9}, {"us", 1e-6}, {"ms", 1e-3}, {"s", 1.0}}, "s");
  const size_t image = images.empty() ? 0 : section->Column(&csv, "image");
  if (Status good = section->Check(csv); !good) return good;
  while (csv.NextRow()) {
    AddFrame(csv.Time(columns.time, columns.time_unit_s, columns.time_offset_ns), csv, order,
             recording);
    Frame& frame = recording->frames.back();
    if (has_exposure) frame.exposure_s = exposure_unit_s * csv.Number(exposure);
    if (images.empty()) continue;
    const std::string place = Concat(file, ":", csv.line());
    const auto path = PathInside(images, std::string(csv.Cell(image)), place);
    if (!path) return tl::unexpected(path.error());
    if (!fs::is_regular_file(*path)) {
      return BadInput(Concat(place, ": ", *path, " does not exist, expected an image"));
    }
    frame.image_file = *path;
  }
  return csv.status() ? CheckFrames(file, recording->frames) : csv.status();
}

Status ReadCamera(Section section, Recording* recording) {
  section.keys().AllowOnly({"video", "images", "frames", "separator", "time", "time_unit",
                            "time_offset_s", "image", "exposure", "exposure_unit", "sensor_yaml"});
  const std::string video = section.File("video"), images = section.File("images");
  const std::string table = section.File("frames"), sensor = section.File("sensor_yaml");
  if (section.status() && video.empty() == images.empty()) {
    section.keys().Fail("video", "expected either `video` or `images` below `camera`");
  }
  if (section.status() && !images.empty() && table.empty()) {
    section.keys().Fail("frames", "is missing below `camera`, expected the table of the images");
  }
  if (!section.status()) return section.status();
  if (!sensor.empty()) {
    if (!fs::is_regular_file(sensor)) return BadInput(sensor + ": cannot be opened for reading");
    const Result<SensorYaml> yaml = ReadSensorYaml(sensor);
    if (!yaml) return tl::unexpected(yaml.error());
    recording->camera = yaml->camera;
    recording->camera.q_gyro_cam = yaml->q_body_sensor;
  }
  Status status;
  FrameOrder order;
  if (!table.empty()) status = ReadFrames(table, images, &section, &order, recording);
  if (!status) return status;
  if (!video.empty()) {
    status = AddVideo(video, table, sensor, recording);
  } else {
    const std::string& first = recording->frames.front().image_file;
    const Result<cv::Mat> image = ReadGrayImage(first);
    if (!image) return tl::unexpected(image.error());
    status = SetResolution(image->cols, image->rows, first, sensor, &recording->camera);
  }
  return status ? order.Mend(table.empty() ? video : table, recording) : status;
}

// Where the lens was, after the camera, whose pixels and frames it needs.
Status ReadLens(Section section, Recording* recording) {
  section.keys().AllowOnly(
      {"file", "separator", "time", "time_unit", "time_offset_s", "columns", "px_per_unit"});
  const std::string file = section.File("file");
  if (section.status() && file.empty())
    section.keys().Fail("file", "is missing below `lens_shift`");
  if (!section.status()) return section.status();
  CsvReader csv = section.Table(file);
  SampleColumns columns;
  section.Time(&csv, &columns);
  const std::array<size_t, 2> at =
      section.Columns<2>("[x, y], two names or numbers of columns", &csv);
  const double px_per_unit = section.keys().Number("px_per_unit").value_or(1.0);
  if (Status good = section.Check(csv); !good) return good;
  std::vector<LensSample> samples;
  while (csv.NextRow()) {
    const int64_t stamp_ns = csv.Time(columns.time, columns.time_unit_s, columns.time_offset_ns);
    samples.push_back(
        {stamp_ns, px_per_unit * Eigen::Vector2d(csv.Number(at[0]), csv.Number(at[1]))});
  }
  return csv.status() ? SetLensShift(file, std::move(samples), recording) : csv.status();
}

// What the section `bag` names.
struct NamedBag {
  std::string file;
  OpenBag open = nullptr;
  BagTopics topics;
};

Result<NamedBag> FindBag(Section section) {
  section.keys().AllowOnly({"file", "imu_topic", "image_topic"});
  NamedBag bag;
  bag.file = section.File("file");
  if (section.status() && bag.file.empty()) section.keys().Fail("file", "is missing below `bag`");
  bag.topics = {section.keys().Text("imu_topic").value_or(""),
                section.keys().Text("image_topic").value_or("")};
  if (!section.status()) return tl::unexpected(section.status().error());
  const RecordingFormat* format = fs::exists(bag.file) ? FindFormat(bag.file) : nullptr;
  if (format != nullptr) {
    if (Status built = CheckBuilt(*format, bag.file); !built) return tl::unexpected(built.error());
    bag.open = format->open_bag;
  }
  if (bag.open != nullptr) return bag;
  return BadInput(bag.file + ": expected a ROS bag, .bag, .db3, .mcap or a folder of them");
}

Result<Recording> ReadSections(const std::string& yaml, const YAML::Node& root) {
  if (!root.IsMap()) return BadInput(yaml + ":1: expected lines of `key: value`");
  YamlKeys keys(yaml, root);
  keys.AllowOnly({"gyro", "accel", "camera", "lens_shift", "bag"});
  if (root["bag"].IsDefined()) {
    keys.AllowOnly({"bag"});
    if (!keys.status()) return tl::unexpected(keys.status().error());
    const Result<NamedBag> bag = FindBag(Section(yaml, root, "bag"));
    if (!bag) return tl::unexpected(bag.error());
    Result<Recording> recording = ReadBag(bag->file, bag->open, bag->topics);
    if (recording) recording->video_file = yaml;
    return recording;
  }
  for (const char* section : {"gyro", "camera"}) {
    if (!root[section].IsDefined())
      keys.Fail(section, "is missing; expected gyro and camera, or bag");
  }
  Recording recording;
  Status status = keys.status();
  if (status) status = ReadGyro(Section(yaml, root, "gyro"), &recording);
  Section accel(yaml, root, "accel");
  if (status && accel.is_there()) status = ReadAccel(std::move(accel), &recording);
  if (status) status = ReadCamera(Section(yaml, root, "camera"), &recording);
  if (status) status = CheckFrames(yaml + ": camera", recording.frames);
  Section lens(yaml, root, "lens_shift");
  if (status && lens.is_there()) status = ReadLens(std::move(lens), &recording);
  if (!status) return tl::unexpected(status.error());
  NoteClocks(&recording);
  return recording;
}

}  // namespace

bool IsRecordingYaml(const std::string& path) {
  return fs::path(path).filename() == kName || fs::is_regular_file(fs::path(path) / kName);
}

Result<Recording> ReadRecordingYaml(const std::string& path) {
  const std::string yaml =
      fs::is_directory(path) ? (fs::path(path) / kName).string() : fs::absolute(path).string();
  try {
    Result<Recording> recording = ReadSections(yaml, YAML::LoadFile(yaml));
    if (recording) recording->path = path;
    return recording;
  } catch (const YAML::Exception& error) {
    return BadInput(Concat(yaml, ":", error.mark.line + 1, ": not valid YAML: ", error.msg));
  }
}

Result<std::unique_ptr<FrameSource>> OpenRecordingYamlFrames(const Recording& recording) {
  const std::string& yaml = recording.video_file;
  try {
    const Result<NamedBag> bag = FindBag(Section(yaml, YAML::LoadFile(yaml), "bag"));
    if (!bag) return tl::unexpected(bag.error());
    return OpenBagFrames(recording, bag->file, bag->open, bag->topics);
  } catch (const YAML::Exception& error) {
    return BadInput(Concat(yaml, ":", error.mark.line + 1, ": not valid YAML: ", error.msg));
  }
}

}  // namespace camgyro
