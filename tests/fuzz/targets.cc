#include "tests/fuzz/targets.h"

#include <unistd.h>

#include <fstream>
#include <iterator>
#include <opencv2/core/mat.hpp>
#include <utility>

#include "frontend/frame_source.h"
#include "frontend/readers/formats.h"
#include "frontend/readers/gpmf.h"
#include "frontend/readers/read_recording.h"
#include "frontend/readers/text.h"
#include "pipeline/frame_times_file.h"
#include "pipeline/read_calibration.h"
#include "simulation/scenario.h"
#include "simulation/trajectory.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/frontend/readers/ros2_bag_bytes.h"
#include "tests/fuzz/seeds.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

// A recording, and its first pictures: what follows is decoded in the same way.
Status ReadAll(const std::string& path) {
  const Result<Recording> recording = ReadRecording(path);
  if (!recording) return tl::unexpected(recording.error());
  if (recording->video_file.empty() && recording->frames.front().image_file.empty()) return {};
  const auto source = OpenFrames(*recording);
  if (!source) return tl::unexpected(source.error());
  cv::Mat picture;
  for (int i = 0; i < 3; ++i) {
    const Result<bool> next = (*source)->Next(&picture);
    if (!next) return tl::unexpected(next.error());
  }
  return {};
}

Status ReadCalibrationFile(const std::string& path) {
  const Result<std::vector<ListedEffect>> effects = ReadEffects(path);
  if (!effects) return tl::unexpected(effects.error());
  const Result<Calibration> calibration = ReadCalibration(path);
  if (!calibration) return tl::unexpected(calibration.error());
  return {};
}

Status ReadFrameTimes(const std::string& path) {
  Recording recording;
  for (int i = 0; i < 3; ++i) recording.frames.push_back({1000000000 + 33000000ll * i, 0.0, ""});
  return ApplyFrameTimes((fs::path(path).parent_path() / "calibration.yaml").string(), &recording);
}

// Telemetry as it lies in a video, without the container around it.
Status ReadTelemetry(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const auto payload =
      ReadGpmfPayload({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
  if (payload) return {};
  return BadInput(path + ": " + payload.error().message);
}

Status ReadScenario(const std::string& path) {
  const Result<simulation::Scenario> scenario = simulation::LoadScenario(path);
  if (!scenario) return tl::unexpected(scenario.error());
  return {};
}

Status ReadTrajectoryFile(const std::string& path) {
  const auto trajectory =
      simulation::ReadTrajectory(path, /*knot_s=*/0.05, Eigen::Isometry3d::Identity());
  if (!trajectory) return tl::unexpected(trajectory.error());
  return {};
}

Files With(Files files, const Files& more) {
  for (const auto& [name, content] : more) files[name] = content;
  return files;
}

template <const Files& files>
Files WithVideo(const char* video) {
  return With(files, {{video, VideoBytes()}});
}

// Tracks, matches and attitudes without cam0/data.csv, so that each makes frames of its own.
Files Tables() {
  return With(
      TrackRecording(),
      {{"cam0/matches.csv", "#a,b,u,v,u,v\n1000000000,1033000000,1,2,3,4\n"},
       {"cam0/attitude.csv", "1000000000,1,0,0,0\n1033000000,0.8,0.6,0,0\n1066000000,1,0,0,0\n"}});
}
Files WithLens() {
  return With(
      TrackRecording(),
      {{"cam0/lens_shift.csv", "#t,x,y\n1000000000,1,2\n1033000000,-3.5,4\n1066000000,5,1e-1\n"}});
}
Files Images() {
  Files files = TrackRecording();
  files.erase("cam0/tracks.csv");
  files["cam0/data.csv"] = "#t,f,e\n1000000000,a.png,0.005\n1033000000,a.png,0.005\n";
  files["cam0/data/a.png"] = PictureBytes(".png");
  return files;
}
Files Video() {
  Files files = TrackRecording();
  files.erase("cam0/tracks.csv");
  files.erase("cam0/data.csv");
  files["cam0/video.mp4"] = VideoBytes();
  return files;
}

std::vector<std::string> MorePictures() {
  return {PictureBytes(".jpg"), PictureBytes(".bmp"), PictureBytes(".pgm"), PictureBytes(".tiff"),
          PictureBytes(".webp")};
}
std::vector<std::string> MoreMcap() {
  return {Mcap(Drive(), {/*chunks=*/false, /*summary=*/false, ""}),
          Mcap(Drive(), {true, true, "lz4"}), Mcap(Drive(), {true, false, "zstd"})};
}
std::vector<std::string> MoreRecordingYaml() {
  return {
      "gyro: {file: sensors/gyro.csv, separator: ';', time: t_us, time_unit: us,\n"
      "       columns: [wx, wy, wz], unit: deg/s}\n"
      "camera: {images: pictures, frames: frames.csv, time: 1, time_unit: s, image: 2}\n",
      "bag: {file: a.mcap, imu_topic: /imu, image_topic: /cam/image_raw}\n"};
}

Files BagFolder() {
  return {{"metadata.yaml",
           "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
           "  relative_file_paths:\n    - second.db3\n    - folder/first.db3\n"},
          {"second.db3", SqliteBytes(0, 3)},
          {"first.db3", SqliteBytes(3, 7)}};
}

// One row per file.
// NOLINTNEXTLINE(readability-function-size)
const std::vector<FuzzTarget>& AllTargets() {
  static const std::vector<FuzzTarget> targets = {
      {"gyro_csv", "imu0/data.csv", "", TrackRecording, ReadAll},
      {"frames_csv", "cam0/data.csv", "", Images, ReadAll},
      {"tracks_csv", "cam0/tracks.csv", "", TrackRecording, ReadAll},
      {"matches_csv", "cam0/matches.csv", "", Tables, ReadAll},
      {"attitude_csv", "cam0/attitude.csv", "", Tables, ReadAll},
      {"lens_shift_csv", "cam0/lens_shift.csv", "", WithLens, ReadAll},
      {"sensor_yaml", "cam0/sensor.yaml", "", TrackRecording, ReadAll},
      {"picture", "cam0/data/a.png", "", Images, ReadAll, MorePictures},
      {"video", "cam0/video.mp4", "", Video, ReadAll},
      {"recording_yaml", "recording.yaml", "",
       [] {
         return With(WithVideo<kDescribed>("clip.mp4"), {{"a.mcap", Mcap(Drive(), {})},
                                                         {"pictures/5", PictureBytes(".png")},
                                                         {"pictures/10", PictureBytes(".png")}});
       },
       ReadAll, MoreRecordingYaml},
      {"gopro", "a.mp4", "a.mp4",
       [] {
         return Files{{"a.mp4", GoProBytes()}};
       },
       ReadAll},
      {"gpmf", "a.gpmf", "a.gpmf",
       [] {
         return Files{{"a.gpmf", Telemetry(0)}};
       },
       ReadTelemetry},
      {"gcsv", "a.gcsv", "a.gcsv", [] { return WithVideo<kGcsv>("a.mp4"); }, ReadAll},
      {"video_imu_capture", "video_meta.pb3", "",
       [] {
         return Files{{"video_meta.pb3", VideoMetaBytes()}, {"video_recording.mp4", VideoBytes()}};
       },
       ReadAll},
      {"mars_logger", "movie_metadata.csv", "", [] { return WithVideo<kMars>("movie.mp4"); },
       ReadAll},
      {"stray_scanner", "odometry.csv", "", [] { return WithVideo<kStray>("rgb.mp4"); }, ReadAll},
      {"ios_logger", "Frames.txt", "", [] { return WithVideo<kIos>("Frames.m4v"); }, ReadAll},
      {"open_camera", "VID_1_timestamps.csv", "",
       [] { return WithVideo<kOpenCamera>("VID_1.mp4"); }, ReadAll},
      {"sensor_logger", "GyroscopeUncalibrated.csv", "",
       [] { return WithVideo<kSensorLogger>("Camera/1698501144400.mp4"); }, ReadAll},
      {"jsonl", "data.jsonl", "", [] { return WithVideo<kJsonl>("data.mp4"); }, ReadAll},
      {"mcap", "a.mcap", "a.mcap",
       [] {
         return Files{{"a.mcap", Mcap(Drive(), {})}};
       },
       ReadAll, MoreMcap},
      {"sqlite_bag", "a.db3", "a.db3",
       [] {
         return Files{{"a.db3", SqliteBytes()}};
       },
       ReadAll, [] { return std::vector<std::string>{SqliteBytes(0, 7, "zstd")}; }},
      {"bag_metadata", "metadata.yaml", "", BagFolder, ReadAll},
      {"rosbag", "a.bag", "a.bag",
       [] {
         return Files{{"a.bag", RosbagBytes(false)}};
       },
       ReadAll, [] { return std::vector<std::string>{RosbagBytes(true)}; }},
      {"calibration_yaml", "calibration.yaml", "calibration.yaml",
       [] {
         return Files{{"calibration.yaml", CalibrationBytes()}};
       },
       ReadCalibrationFile, [] { return std::vector<std::string>{TruthBytes()}; }},
      {"frame_times_csv", "frame_times.csv", "frame_times.csv",
       [] {
         return Files{{"frame_times.csv",
                       "#stamp_ns,repaired_stamp_ns,sigma_ns\n1000000000,1000100000,5000\n"
                       "1033000000,1033000000,5000.5\n"}};
       },
       ReadFrameTimes},
      {"scenario", "scenario.yaml", "scenario.yaml",
       [] {
         return Files{{"scenario.yaml",
                       "seed: 3\nduration_s: 4\nmotion: {kind: walking, speed_m_s: 1}\n"
                       "camera: {resolution: [64, 48], focal_px: 50.5}\neffects:\n"
                       "  clock_skew: {ppm: 100}\n"}};
       },
       ReadScenario},
      {"trajectory", "poses.txt", "poses.txt",
       [] {
         return Files{{"poses.txt",
                       "# t x y z qx qy qz qw\n1.0 0 0 0 0 0 0 1\n1.1 0.1 0 0 0 0.6 0 0.8\n"
                       "1.2 0.2 0 0 0 0 0 1\n1.3 0.3 0 0 0 0 0 1\n1.4 0.4 0 0 0 0 0 1\n"}};
       },
       ReadTrajectoryFile}};
  return targets;
}

}  // namespace

const std::vector<FuzzTarget>& FuzzTargets() {
  static const std::vector<FuzzTarget> targets = [] {
    std::vector<FuzzTarget> built;
    for (const FuzzTarget& target : AllTargets()) {
      const std::string file = target.file;
      bool readable = true;
      for (const RecordingFormat& format : RecordingFormats()) {
        if (format.read != nullptr) continue;
        if (format.looks_like == "a folder with " + file) readable = false;
        if (EndsWith(file, ".bag") && std::string(format.looks_like) == "X.bag") readable = false;
      }
      if (readable) built.push_back(target);
    }
    return built;
  }();
  return targets;
}

std::vector<std::string> Seeds(const FuzzTarget& target) {
  std::vector<std::string> seeds = {target.sound().at(target.file)};
  if (target.more_seeds == nullptr) return seeds;
  for (std::string& seed : target.more_seeds()) seeds.push_back(std::move(seed));
  return seeds;
}

FuzzFolder::FuzzFolder(const FuzzTarget& target)
    : target_(target),
      path_(fs::temp_directory_path() /
            ("camgyro_fuzz_" + std::string(target.name) + "_" + std::to_string(getpid()))) {
  fs::remove_all(path_);
  for (const auto& [name, content] : target.sound()) {
    fs::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << content;
  }
}

FuzzFolder::~FuzzFolder() { fs::remove_all(path_); }

Status FuzzFolder::Read(const std::string& bytes) const {
  std::ofstream(path_ / target_.file, std::ios::binary | std::ios::trunc) << bytes;
  const fs::path entry = *target_.entry == '\0' ? path_ : path_ / target_.entry;
  return target_.read(entry.string());
}

std::string FuzzFolder::Flaw(const Status& answer) const {
  if (answer) return "";
  const std::string& message = answer.error().message;
  if (answer.error().kind != ErrorKind::kBadInput) return "is no complaint about input: " + message;
  if (message.find(path_.string()) == std::string::npos) return "names no file: " + message;
  return "";
}

}  // namespace camgyro
