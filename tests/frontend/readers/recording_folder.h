// A recording folder that a test writes file by file; removed at the end of the test.
#ifndef CAMGYRO_TESTS_FRONTEND_READERS_RECORDING_FOLDER_H_
#define CAMGYRO_TESTS_FRONTEND_READERS_RECORDING_FOLDER_H_

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace camgyro {

// Three frames with two tracks, four gyro samples: the least that means something.
inline std::map<std::string, std::string> TrackRecording() {
  return {
      {"cam0/data.csv", "#timestamp [ns]\n1000000000\n1033000000\n1066000000\n"},
      {"cam0/tracks.csv",
       "#timestamp [ns],track_id,u [px],v [px]\n"
       "1000000000,7,10.5,20.25\n1000000000,3,30,40\n"
       "1033000000,7,11,20\n1066000000,3,33,44\n"},
      {"cam0/sensor.yaml",
       "%YAML:1.0\n---\nsensor_type: camera\nrate_hz: 30\nresolution: [64, 48]\n"
       "camera_model: pinhole\nintrinsics: [50.0, 40.0, 31.5, 23.5]\n"
       "distortion_model: radial-tangential\n"
       "distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n"
       "T_BS:\n  cols: 4\n  rows: 4\n"
       "  data: [0, -1, 0, 0.1, 1, 0, 0, 0.2, 0, 0, 1, 0.3, 0, 0, 0, 1]\n"
       "readout_time: 0.025\ntimeshift_cam_imu: -0.004\n"},
      {"imu0/data.csv",
       "#timestamp [ns],w_x [rad s^-1],w_y [rad s^-1],w_z [rad s^-1],"
       "a_x [m s^-2],a_y [m s^-2],a_z [m s^-2]\n"
       "990000000,0.1,0.2,0.3,1,2,9\n1010000000,0.2,0.2,0.3,1,2,9\n"
       "1030000000,-0.1,0.2,0.3,1,2,9\n1070000000,1e-1,0.2,0.3,1,2,9\n"},
      {"imu0/sensor.yaml", "gyroscope_noise_density: 1.7e-04\ngyroscope_random_walk: 1.9e-05\n"}};
}

class RecordingFolder {
 public:
  RecordingFolder() {
    path_ =
        std::filesystem::temp_directory_path() / ("camgyro_recording_" + std::to_string(getpid()));
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_ / "cam0");
    std::filesystem::create_directories(path_ / "imu0");
  }
  ~RecordingFolder() { std::filesystem::remove_all(path_); }
  RecordingFolder(const RecordingFolder&) = delete;
  RecordingFolder& operator=(const RecordingFolder&) = delete;

  std::string path() const { return path_.string(); }
  std::string File(const std::string& name) const { return (path_ / name).string(); }

  void Write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << content;
  }
  void Write(const std::map<std::string, std::string>& files) const {
    for (const auto& [name, content] : files) Write(name, content);
  }
  void Remove(const std::string& name) const { std::filesystem::remove(path_ / name); }

 private:
  std::filesystem::path path_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_READERS_RECORDING_FOLDER_H_
