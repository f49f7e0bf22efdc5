#include "frontend/readers/video_imu_capture_reader.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/robust_statistics.h"
#include "frontend/readers/add_pictures.h"
#include "frontend/readers/frame_order.h"
#include "frontend/readers/lens_shift.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"
#include "frontend/readers/whole_file.h"
#include "video_imu_capture.pb.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

// A record of the file, for messages.
struct Place {
  const std::string& file;
  int record = 0;  // from 1
  int byte = 0;
};

std::string InWords(const Place& place) {
  return Concat(place.file, ": record ", place.record, ", at byte ", place.byte);
}

tl::unexpected<Error> Refuse(const Place& place, const std::string& message) {
  return BadInput(InWords(place) + ": " + message);
}

Status AddImuSample(const Place& place, const std::string& bytes, GyroCollector* gyro) {
  video_imu::ImuSample sample;
  if (!sample.ParseFromString(bytes)) return Refuse(place, "is damaged, expected an IMU sample");
  if (sample.gyro_size() != 3 || (sample.accel_size() != 3 && sample.accel_size() != 0)) {
    return Refuse(place, Concat("gyro has ", sample.gyro_size(), " and accel ", sample.accel_size(),
                                " values, expected 3"));
  }
  const Eigen::Vector3d rates(sample.gyro(0), sample.gyro(1), sample.gyro(2));
  std::optional<Eigen::Vector3d> accel;
  if (sample.accel_size() == 3) {
    accel = Eigen::Vector3d(sample.accel(0), sample.accel(1), sample.accel(2));
  }
  if (!rates.allFinite() || (accel && !accel->allFinite())) {
    return Refuse(place, "gyro or accel is not finite");
  }
  gyro->Add({sample.time_ns(), rates}, accel, [&] { return InWords(place); });
  return {};
}

// The records of the file, one after the other, so that a file that is cut short tells where.
Status ReadMeta(const std::string& file, Recording* recording, int* sensor_width_px,
                std::vector<video_imu::FrameInfo>* frames) {
  const Result<std::string> content = ReadWholeFile(file);
  if (!content) return tl::unexpected(content.error());
  if (content->size() > static_cast<size_t>(std::numeric_limits<int>::max())) {
    return BadInput(Concat(file, ": is larger than 2 GiB"));
  }
  const int size = static_cast<int>(content->size());
  CodedInputStream stream(reinterpret_cast<const uint8_t*>(content->data()), size);
  GyroCollector gyro(recording);
  Place place{file};
  std::string bytes;
  while (stream.CurrentPosition() < size) {
    ++place.record;
    place.byte = stream.CurrentPosition();
    const uint32_t tag = stream.ReadTag();
    uint32_t length = 0;
    if (tag != 0 &&
        WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      return Refuse(place, "is damaged, expected a message of VideoIMUCapture");
    }
    if (tag == 0 || !stream.ReadVarint32(&length) ||
        length > static_cast<uint32_t>(size - stream.CurrentPosition()) ||
        !stream.ReadString(&bytes, static_cast<int>(length))) {
      return Refuse(place, "the file is cut short or damaged");
    }
    Status status;
    switch (WireFormatLite::GetTagFieldNumber(tag)) {
      case video_imu::VideoCaptureData::kCameraMetaFieldNumber: {
        video_imu::CameraInfo camera;
        if (!camera.ParseFromString(bytes)) return Refuse(place, "is damaged, expected a camera");
        if (camera.video_stabilization()) {
          recording->declared_stabilisation = "video_stabilization";
        }
        if (camera.optical_image_stabilization()) {
          recording->notes.push_back(
              Concat(file, ": optical image stabilisation was on: the principal point moves"));
        }
        *sensor_width_px = camera.pre_correction_active_array_size().width();
        break;
      }
      case video_imu::VideoCaptureData::kImuFieldNumber:
        status = AddImuSample(place, bytes, &gyro);
        break;
      case video_imu::VideoCaptureData::kVideoMetaFieldNumber:
        if (!frames->emplace_back().ParseFromString(bytes)) {
          return Refuse(place, "is damaged, expected a picture's metadata");
        }
        break;
      default:
        break;  // time, sensor names: not needed
    }
    if (!status) return status;
  }
  return gyro.Finish(file);
}

// Puts the stamps of numbered pictures upon the video's; the recording has the container's.
Status MergeFrames(const std::string& file, const std::vector<video_imu::FrameInfo>& infos,
                   Recording* recording) {
  std::vector<Frame>& frames = recording->frames;
  std::vector<bool> seen(frames.size(), false);
  std::vector<double> shifts_ns, focal_px, readout_s;
  const int64_t origin_ns = infos.empty() ? 0 : infos.front().time_ns();
  for (const video_imu::FrameInfo& info : infos) {
    const int64_t number = info.frame_number();
    if (number < 0 || number >= static_cast<int64_t>(frames.size())) {
      return BadInput(Concat(file, ": has a picture number ", number, ", but the video has ",
                             frames.size(), " pictures"));
    }
    Frame& frame = frames[static_cast<size_t>(number)];
    if (seen[static_cast<size_t>(number)]) {
      return BadInput(Concat(file, ": picture ", number, " is there twice, expected once"));
    }
    seen[static_cast<size_t>(number)] = true;
    shifts_ns.push_back(static_cast<double>(info.time_ns() - origin_ns - frame.stamp_ns));
    frame.stamp_ns = info.time_ns();
    if (info.exposure_time_ns() > 0) {
      frame.exposure_s = 1e-9 * static_cast<double>(info.exposure_time_ns());
    }
    if (info.est_focal_length_pix() > 0.0f) focal_px.push_back(info.est_focal_length_pix());
    if (info.frame_readout_ns() > 0) {
      readout_s.push_back(1e-9 * static_cast<double>(info.frame_readout_ns()));
    }
  }
  if (shifts_ns.empty()) return BadInput(Concat(file, ": has no pictures, expected their stamps"));
  const int64_t shift_ns = origin_ns + std::llround(MedianInPlace(&shifts_ns));
  size_t missing = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (!seen[i]) {
      frames[i].stamp_ns += shift_ns;
      ++missing;
    }
  }
  if (missing > 0) {
    recording->notes.push_back(Concat(file, ": has no stamps for ", missing, " of ", frames.size(),
                                      " pictures; they have the container's, shifted"));
  }
  if (!focal_px.empty()) recording->camera.focal_px = MedianInPlace(&focal_px);
  if (!readout_s.empty()) recording->camera.readout_s = MedianInPlace(&readout_s);
  return {};
}

// Where the lens was, if the phone says so, in pixels of the picture: the app's videos are as wide
// as the sensor.
Status AddLensPositions(const std::string& file, const std::vector<video_imu::FrameInfo>& infos,
                        int sensor_width_px, Recording* recording) {
  std::vector<LensSample> samples;
  const double scale = recording->camera.width_px / std::max(1.0, 1.0 * sensor_width_px);
  for (const video_imu::FrameInfo& info : infos) {
    for (const video_imu::LensPosition& lens : info.ois_samples()) {
      samples.push_back({lens.time_ns(), scale * Eigen::Vector2d(lens.x_shift(), lens.y_shift())});
    }
  }
  if (samples.empty()) return {};
  if (sensor_width_px > 0) return SetLensShift(file, std::move(samples), recording);
  recording->notes.push_back(
      file +
      ": has no width of the sensor, so that its OIS_samples, in pixels of it, are not used");
  return {};
}

}  // namespace

Result<Recording> ReadVideoImuCapture(const std::string& folder) {
  const std::string meta = (fs::path(folder) / "video_meta.pb3").string();
  const std::string video = (fs::path(folder) / "video_recording.mp4").string();
  if (!fs::is_regular_file(video)) {
    return BadInput(
        Concat(folder, ": has video_meta.pb3 of VideoIMUCapture, but no video_recording.mp4"));
  }
  Recording recording;
  recording.path = folder;
  std::vector<video_imu::FrameInfo> infos;
  int sensor_width_px = 0;
  Status status = ReadMeta(meta, &recording, &sensor_width_px, &infos);
  if (status) status = AddVideo(video, meta, meta, &recording);
  if (status) status = MergeFrames(meta, infos, &recording);
  if (status) status = CheckFrames(meta, recording.frames);
  if (status) status = FrameOrder().Mend(meta, &recording);
  if (status) status = AddLensPositions(meta, infos, sensor_width_px, &recording);
  if (!status) return tl::unexpected(status.error());
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
