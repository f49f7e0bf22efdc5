// A recording folder that a test writes file by file; removed at the end of the test.
#ifndef CAMGYRO_TESTS_FRONTEND_RECORDING_FOLDER_H_
#define CAMGYRO_TESTS_FRONTEND_RECORDING_FOLDER_H_

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace camgyro {

class RecordingFolder {
 public:
  RecordingFolder() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            (std::string("camgyro_") + test->name() + "_" + std::to_string(getpid()));
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

#endif  // CAMGYRO_TESTS_FRONTEND_RECORDING_FOLDER_H_
