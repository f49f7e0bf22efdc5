#include "frontend/readers/folder_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/readers/add_pictures.h"
#include "frontend/readers/camera_csv.h"
#include "frontend/readers/image_file.h"
#include "frontend/readers/imu_csv.h"
#include "frontend/readers/inside_folder.h"
#include "frontend/readers/lens_shift.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sensor_yaml.h"
#include "frontend/readers/text.h"
#include "frontend/stamp_clock.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

// The files of cam0/ that exist; empty names for those that do not.
struct CameraFiles {
  std::string data, images, video, tracks, matches, attitude, lens_shift, yaml;
};

CameraFiles FindCameraFiles(const fs::path& cam) {
  const auto existing = [&](const char* name) {
    return fs::exists(cam / name) ? (cam / name).string() : std::string();
  };
  return {existing("data.csv"),       (cam / "data").string(),       existing("video.mp4"),
          existing("tracks.csv"),     existing("matches.csv"),       existing("attitude.csv"),
          existing("lens_shift.csv"), (cam / "sensor.yaml").string()};
}

Status AddImages(const CameraFiles& files, const FrameTable& table, Recording* recording) {
  for (size_t i = 0; i < table.frames.size(); ++i) {
    const std::string line = Concat(files.data, ":", table.lines[i]);
    const auto image = PathInside(files.images, table.frames[i].image_file, line);
    if (!image) return tl::unexpected(image.error());
    if (!fs::is_regular_file(*image)) {
      return BadInput(Concat(line, ": ", *image, " does not exist, expected an image"));
    }
    recording->frames[i].image_file = *image;
  }
  const std::string& first = recording->frames.front().image_file;
  const Result<cv::Mat> image = ReadGrayImage(first);
  if (!image) return tl::unexpected(image.error());
  return SetResolution(image->cols, image->rows, first, files.yaml, &recording->camera);
}

// Frames for tracks, matches or attitudes that come without cam0/data.csv.
Status AddFramesOfTables(const CameraFiles& files, Recording* recording) {
  std::vector<int64_t> stamps;
  const auto merge = [&](const Result<std::vector<int64_t>>& more) -> Status {
    if (!more) return tl::unexpected(more.error());
    stamps.insert(stamps.end(), more->begin(), more->end());
    return {};
  };
  Status status;
  if (!files.tracks.empty()) status = merge(ReadTrackStamps(files.tracks));
  if (status && !files.matches.empty()) status = merge(ReadMatchStamps(files.matches));
  if (status && !files.attitude.empty()) status = merge(ReadAttitudeStamps(files.attitude));
  if (!status) return status;
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  for (const int64_t stamp_ns : stamps) recording->frames.emplace_back().stamp_ns = stamp_ns;
  return {};
}

// A note if sensor.yaml declares another rate than the stamps have, by more than a tenth. Theirs is
// that of the clock behind them: of stamps of arrival, half may follow each other at once.
void NoteRate(const fs::path& part, std::optional<double> declared_hz,
              const std::vector<int64_t>& stamps_ns, Recording* recording) {
  const double interval_s = FindStampClock(stamps_ns).report.period_s;
  if (!declared_hz || !(interval_s > 0.0) || std::abs(*declared_hz * interval_s - 1.0) < 0.1)
    return;
  recording->notes.push_back(Concat((part / "sensor.yaml").string(), ": says rate_hz ",
                                    *declared_hz, ", but the stamps of ", part.filename().string(),
                                    " give ", 1.0 / interval_s, " Hz"));
}

Status ReadCamera(const fs::path& cam, Recording* recording) {
  const CameraFiles files = FindCameraFiles(cam);
  const Result<SensorYaml> yaml = ReadSensorYaml(files.yaml);
  if (!yaml) return tl::unexpected(yaml.error());
  recording->camera = yaml->camera;
  recording->camera.q_gyro_cam = yaml->q_body_sensor;  // the IMU's own T_BS is applied later

  FrameTable table;
  if (!files.data.empty()) {
    Result<FrameTable> read = ReadFrameTable(files.data);
    if (!read) return tl::unexpected(read.error());
    table = std::move(*read);
    recording->frames = table.frames;
    if (table.frames.size() < 2) {
      return BadInput(
          Concat(files.data, ": has ", table.frames.size(), " frames, expected at least two"));
    }
  }
  const bool has_images = !table.frames.empty() && !table.frames.front().image_file.empty();
  const bool has_tables =
      !files.tracks.empty() || !files.matches.empty() || !files.attitude.empty();
  if (has_images) {
    if (Status status = AddImages(files, table, recording); !status) return status;
  } else if (!files.video.empty()) {
    if (table.frames.empty()) {
      recording->notes.push_back(
          Concat(files.video, ": frame stamps are the container's, as there is no cam0/data.csv"));
    }
    if (Status status = AddVideo(files.video, files.data, files.yaml, recording); !status) {
      return status;
    }
  } else if (!has_tables) {
    return BadInput(Concat(cam.string(),
                           ": nothing to calibrate with; expected file names in data.csv and the "
                           "images in data/, or video.mp4, tracks.csv, matches.csv, attitude.csv"));
  } else if (table.frames.empty()) {
    if (Status status = AddFramesOfTables(files, recording); !status) return status;
  }
  if (Status frames = CheckFrames(cam.string(), recording->frames); !frames) return frames;
  const std::string& frames_of = files.data.empty() ? files.video : files.data;
  if (Status mended = table.order.Mend(frames_of, recording); !mended) return mended;
  NoteRate(cam, yaml->rate_hz, StampsOf(recording->frames), recording);
  if (recording->camera.width_px == 0 && (!files.tracks.empty() || !files.matches.empty())) {
    return BadInput(Concat(files.tracks.empty() ? files.matches : files.tracks,
                           ": the size of the pictures is needed to read pixels as rows in time; "
                           "expected `resolution: [width, height]` in ",
                           files.yaml));
  }

  Status status;
  if (!files.tracks.empty()) status = ReadTracks(files.tracks, recording);
  if (status && !files.matches.empty()) status = ReadMatches(files.matches, recording);
  if (status && !files.attitude.empty()) status = ReadAttitudes(files.attitude, recording);
  if (status && !files.lens_shift.empty()) status = ReadLensShift(files.lens_shift, recording);
  return status;
}

Status ReadImu(const fs::path& imu, Recording* recording) {
  const Result<SensorYaml> yaml = ReadSensorYaml((imu / "sensor.yaml").string());
  if (!yaml) return tl::unexpected(yaml.error());
  recording->gyro_info = yaml->gyro;
  recording->gyro_info.declared_rate_hz = yaml->rate_hz;
  if (recording->camera.q_gyro_cam && yaml->q_body_sensor) {
    recording->camera.q_gyro_cam = yaml->q_body_sensor->conjugate() * *recording->camera.q_gyro_cam;
  }
  Status status = ReadImuCsv((imu / "data.csv").string(), recording);
  if (status) NoteRate(imu, yaml->rate_hz, StampsOf(recording->gyro), recording);
  return status;
}

}  // namespace

Result<Recording> ReadFolder(const std::string& folder) {
  const fs::path root =
      fs::is_directory(fs::path(folder) / "mav0") ? fs::path(folder) / "mav0" : fs::path(folder);
  for (const char* part : {"cam0", "imu0"}) {
    if (!fs::is_directory(root / part)) {
      return BadInput(Concat(folder, ": has no folder ", part,
                             "/; expected a recording with cam0/ and imu0/ (docs/"
                             "recording_format.md), or the path of a GoPro MP4 file"));
    }
  }
  Recording recording;
  recording.path = folder;
  if (Status status = ReadCamera(root / "cam0", &recording); !status) {
    return tl::unexpected(status.error());
  }
  if (Status status = ReadImu(root / "imu0", &recording); !status) {
    return tl::unexpected(status.error());
  }
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
