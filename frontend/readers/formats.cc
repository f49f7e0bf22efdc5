#include "frontend/readers/formats.h"

#include <filesystem>
#include <fstream>

#include "frontend/readers/folder_reader.h"
#include "frontend/readers/gcsv_reader.h"
#include "frontend/readers/gopro_reader.h"
#include "frontend/readers/ios_logger_reader.h"
#include "frontend/readers/jsonl_reader.h"
#include "frontend/readers/mars_logger_reader.h"
#include "frontend/readers/open_camera_reader.h"
#include "frontend/readers/recording_yaml_reader.h"
#include "frontend/readers/ros2_bag_reader.h"
#include "frontend/readers/rosbag_reader.h"
#include "frontend/readers/sensor_logger_reader.h"
#include "frontend/readers/stray_scanner_reader.h"
#include "frontend/readers/text.h"
#include "frontend/readers/video_imu_capture_reader.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

using Read = Result<Recording> (*)(const std::string&);

template <OpenBag open>
Result<Recording> ReadBagWith(const std::string& path) {
  return ReadBag(path, open);
}

using OpenPictures = Result<std::unique_ptr<FrameSource>> (*)(const Recording&);

template <OpenBag open>
Result<std::unique_ptr<FrameSource>> OpenPicturesWith(const Recording& recording) {
  return OpenBagFrames(recording, recording.video_file, open);
}

// The readers that a build may be without (frontend/CMakeLists.txt).
#ifdef CAMGYRO_WITH_PROTOBUF
constexpr Read kReadVideoImuCapture = ReadVideoImuCapture;
#else
constexpr Read kReadVideoImuCapture = nullptr;
#endif
#ifdef CAMGYRO_WITH_ROSBAG
constexpr Read kReadRosbag = ReadBagWith<OpenRosbag>;
constexpr OpenPictures kOpenRosbagPictures = OpenPicturesWith<OpenRosbag>;
constexpr OpenBag kOpenRosbag = OpenRosbag;
#else
constexpr Read kReadRosbag = nullptr;
constexpr OpenPictures kOpenRosbagPictures = nullptr;
constexpr OpenBag kOpenRosbag = nullptr;
#endif

bool HasFile(const std::string& folder, const char* name) {
  return fs::is_regular_file(fs::path(folder) / name);
}

bool IsOwnFolder(const std::string& path) {
  for (const char* part : {"cam0", "imu0", "mav0"}) {
    if (fs::is_directory(fs::path(path) / part)) return true;
  }
  return false;
}

// ISO 14496-12 and QuickTime: the name of the first box, behind its size.
bool IsMp4(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char head[8] = {};
  in.read(head, sizeof head);
  const std::string name(head + 4, 4);
  return in && (name == "ftyp" || name == "moov" || name == "mdat" || name == "wide" ||
                name == "free" || name == "skip");
}

}  // namespace

const std::vector<RecordingFormat>& RecordingFormats() {
  static const std::vector<RecordingFormat> formats = {
      {"EuRoC/ASL folder", "a folder with cam0/ and imu0/, or mav0/ with them inside", IsOwnFolder,
       ReadFolder},
      {"recording.yaml", "a file recording.yaml that describes other files", IsRecordingYaml,
       ReadRecordingYaml, "", OpenRecordingYamlFrames},
      {"VideoIMUCapture", "a folder with video_meta.pb3",
       [](const std::string& path) { return HasFile(path, "video_meta.pb3"); },
       kReadVideoImuCapture, "libprotobuf-dev and protobuf-compiler"},
      {"MARSLogger", "a folder with gyro_accel.csv", IsMarsLogger, ReadMarsLogger},
      {"Stray Scanner", "a folder with imu.csv and odometry.csv", IsStrayScanner, ReadStrayScanner},
      {"ios_logger", "a folder with Gyro.txt and Frames.txt or ARposes.txt", IsIosLogger,
       ReadIosLogger},
      {"JSON lines", "a folder with data.jsonl and data.mp4 (android-viotester, ...)", IsJsonl,
       ReadJsonl},
      {"Sensor Logger", "a folder with Gyroscope.csv or GyroscopeUncalibrated.csv", IsSensorLogger,
       ReadSensorLogger},
      {"OpenCamera Sensors", "a folder with VIDEO_gyro.csv and VIDEO_timestamps.csv", IsOpenCamera,
       ReadOpenCamera},
      {"ROS 2 bag", "X.db3, X.mcap, or a folder of them with metadata.yaml", IsRos2Bag,
       ReadBagWith<OpenRos2Bag>, "", OpenPicturesWith<OpenRos2Bag>, OpenRos2Bag},
      {"ROS 1 bag", "X.bag", [](const std::string& path) { return EndsWith(path, ".bag"); },
       kReadRosbag, "librosbag-storage-dev and libsensor-msgs-dev", kOpenRosbagPictures,
       kOpenRosbag},
      {"Gyroflow", "X.gcsv, or a video with X.gcsv beside it", IsGcsv, ReadGcsv},
      {"GoPro MP4", "a video with GPMF telemetry inside", IsMp4, ReadGoPro},
  };
  return formats;
}

const RecordingFormat* FindFormat(const std::string& path) {
  for (const RecordingFormat& format : RecordingFormats()) {
    if (format.matches(path)) return &format;
  }
  return nullptr;
}

Status CheckBuilt(const RecordingFormat& format, const std::string& path) {
  if (format.read != nullptr) return {};
  return BadInput(Concat(path, ": a recording of the format ", format.name,
                         "; this camgyro was built without the library that reading it needs (",
                         format.needs, ")"));
}

std::string ListFormats() {
  std::string list;
  for (const RecordingFormat& format : RecordingFormats()) {
    list += Concat(list.empty() ? "" : "; ", format.name, " (", format.looks_like, ")");
  }
  return list;
}

}  // namespace camgyro
