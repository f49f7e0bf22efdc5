#include "frontend/readers/jsonl_reader.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "core/robust_statistics.h"
#include "frontend/readers/add_pictures.h"
#include "frontend/readers/frame_order.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"
#include "frontend/readers/whole_file.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kLargestTimeS = 9e9;  // 285 years, which fit into nanoseconds

std::optional<double> Number(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  if (!object.is_object() || found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

// The lines of data.jsonl, one after the other.
class Lines {
 public:
  Lines(const std::string& file, Recording* recording)
      : file_(file), recording_(recording), gyro_(recording) {}

  Status Read() {
    if (Status is_file = CheckIsFile(file_); !is_file) return is_file;
    std::ifstream in(file_, std::ios::binary);
    if (!in) return BadInput(file_ + ": cannot be opened for reading");
    std::string text;
    while (std::getline(in, text)) {
      ++line_;
      if (Trim(text).empty()) continue;
      const Json object = Json::parse(text, nullptr, /*allow_exceptions=*/false);
      if (!object.is_object()) {
        return Wrong("is no JSON object; the file may be cut short or damaged");
      }
      if (Status status = Take(object); !status) return status;
    }
    SetCamera();
    Status status = gyro_.Finish(file_);
    if (status) MendAccel(file_, recording_);
    return status;
  }
  const FrameOrder& order() const { return order_; }

 private:
  std::string Place() const { return Concat(file_, ":", line_); }
  tl::unexpected<Error> Wrong(const std::string& message) const {
    return BadInput(Place() + ": " + message);
  }

  Result<int64_t> Stamp(const std::optional<double>& time_s) const {
    if (time_s && std::abs(*time_s) < kLargestTimeS) return std::llround(*time_s * 1e9);
    return Wrong("expected \"time\": a number of seconds");
  }

  Status Take(const Json& object) {
    const auto sensor = object.find("sensor"), frames = object.find("frames");
    const std::optional<double> time_s = Number(object, "time");
    if (sensor != object.end() && sensor->is_object()) return TakeSensor(*sensor, time_s);
    if (frames == object.end() || !frames->is_array()) return {};
    for (const Json& frame : *frames) {
      if (Number(frame, "cameraInd").value_or(0.0) == 0.0) return TakeFrame(frame, time_s);
    }
    return {};
  }

  Status TakeSensor(const Json& sensor, const std::optional<double>& time_s) {
    const auto type = sensor.find("type"), values = sensor.find("values");
    const bool is_gyro = type != sensor.end() && *type == "gyroscope";
    if (!is_gyro && (type == sensor.end() || *type != "accelerometer")) return {};
    const auto stamp_ns = Stamp(time_s);
    if (!stamp_ns) return tl::unexpected(stamp_ns.error());
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    bool good = values != sensor.end() && values->is_array() && values->size() == 3;
    for (int i = 0; good && i < 3; ++i) {
      const Json& number = (*values)[static_cast<size_t>(i)];
      good = number.is_number();
      if (good) value[i] = number.get<double>();
    }
    if (!good || !value.allFinite()) return Wrong("expected \"values\": three numbers");
    if (is_gyro) {
      gyro_.Add({*stamp_ns, value}, std::nullopt, [this] { return Place(); });
      return {};
    }
    recording_->accel.push_back({*stamp_ns, value});
    return {};
  }

  Status TakeFrame(const Json& json, const std::optional<double>& time_s) {
    const std::optional<double> own_s = Number(json, "time");
    const auto stamp_ns = Stamp(own_s ? own_s : time_s);
    if (!stamp_ns) return tl::unexpected(stamp_ns.error());
    Frame frame;
    frame.stamp_ns = *stamp_ns;
    frame.exposure_s = Number(json, "exposureTimeSeconds").value_or(frame.exposure_s);
    order_.Add(
        std::move(frame), [this] { return Place(); }, &recording_->frames);
    const auto camera = json.find("cameraParameters");
    if (!json.is_object() || camera == json.end()) return {};
    const auto fx = Number(*camera, "focalLengthX"), fy = Number(*camera, "focalLengthY");
    const auto cx = Number(*camera, "principalPointX"), cy = Number(*camera, "principalPointY");
    if (fx && *fx > 0.0) fx_.push_back(*fx);
    if (fy && *fy > 0.0) fy_.push_back(*fy);
    if (cx) cx_.push_back(*cx);
    if (cy) cy_.push_back(*cy);
    return {};
  }

  void SetCamera() {
    CameraGuess& camera = recording_->camera;
    if (fy_.empty()) fy_ = fx_;
    if (fy_.empty()) return;
    camera.focal_px = MedianInPlace(&fy_);
    if (!fx_.empty()) camera.aspect_ratio = MedianInPlace(&fx_) / *camera.focal_px;
    if (!cx_.empty() && !cy_.empty()) {
      camera.principal_px = Eigen::Vector2d(MedianInPlace(&cx_), MedianInPlace(&cy_));
    }
  }

  const std::string& file_;
  Recording* const recording_;
  GyroCollector gyro_;
  FrameOrder order_;
  int line_ = 0;
  std::vector<double> fx_, fy_, cx_, cy_;
};

}  // namespace

bool IsJsonl(const std::string& folder) {
  return fs::is_regular_file(fs::path(folder) / "data.jsonl");
}

Result<Recording> ReadJsonl(const std::string& folder) {
  const std::string file = (fs::path(folder) / "data.jsonl").string();
  std::string video;
  for (const char* extension : {".mp4", ".mov", ".mkv", ".avi", ".MOV"}) {
    const fs::path candidate = fs::path(file).replace_extension(extension);
    if (video.empty() && fs::is_regular_file(candidate)) video = candidate.string();
  }
  if (video.empty()) {
    return BadInput(Concat(folder, ": has data.jsonl, but no data.mp4, .mov, .mkv or .avi"));
  }
  Recording recording;
  recording.path = folder;
  Lines lines(file, &recording);
  Status status = lines.Read();
  if (status) status = CheckFrames(file, recording.frames);
  if (status) status = AddVideo(video, file, file, &recording);
  if (status) status = lines.order().Mend(file, &recording);
  if (!status) return tl::unexpected(status.error());
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
