// The folder of a logger that a test writes file by file, with a video.
#ifndef CAMGYRO_TESTS_FRONTEND_READERS_LOGGER_FOLDER_H_
#define CAMGYRO_TESTS_FRONTEND_READERS_LOGGER_FOLDER_H_

#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <vector>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/frontend/readers/sound_logs.h"
#include "tests/frontend/readers/write_video.h"

namespace camgyro {

// A folder beside which nothing else is; three pictures, 40 ms apart, where a video is asked for.
class LoggerFolder {
 public:
  void Write(const Files& files) const { folder_.Write(files); }
  void WriteVideo(const std::string& name, int frames = 3) const {
    VideoSpec spec;
    spec.pictures.assign(static_cast<size_t>(frames), cv::Mat(48, 64, CV_8UC1, cv::Scalar(90)));
    std::filesystem::create_directories(std::filesystem::path(File(name)).parent_path());
    ASSERT_TRUE(camgyro::WriteVideo(File(name), spec));
  }
  void Remove(const std::string& name) const { folder_.Remove("log/" + name); }
  std::string File(const std::string& name) const { return folder_.File("log/" + name); }
  std::string path() const { return folder_.File("log"); }

  RecordingFolder folder_;
};

inline Files In(const std::string& root, const Files& files) {
  Files moved;
  for (const auto& [name, text] : files) moved[root + "/" + name] = text;
  return moved;
}

inline std::vector<int64_t> Stamps(const Recording& recording) {
  std::vector<int64_t> stamps;
  for (const Frame& frame : recording.frames) stamps.push_back(frame.stamp_ns);
  return stamps;
}

// The pictures can be decoded, as many as there are frames.
inline void ExpectPictures(const Recording& recording) {
  auto source = OpenFrames(recording);
  ASSERT_TRUE(source) << source.error().message;
  cv::Mat picture;
  for (size_t i = 0; i < recording.frames.size(); ++i) {
    const Result<bool> next = (*source)->Next(&picture);
    ASSERT_TRUE(next) << next.error().message;
    ASSERT_TRUE(*next);
    EXPECT_EQ(picture.size(), cv::Size(64, 48));
  }
}

// A file of a logger, and what is said if the first text in it is replaced by the second.
struct BrokenFile {
  const char* file;
  const char* before;
  const char* after;
  const char* complaint;
};

// Reads the folder once for every damage of one of its files, which are put back afterwards.
inline void ExpectComplaints(const LoggerFolder& folder, const Files& files,
                             const std::vector<BrokenFile>& broken_files) {
  for (const BrokenFile& broken : broken_files) {
    std::string text = files.at(broken.file);
    const size_t at = text.find(broken.before);
    ASSERT_NE(at, std::string::npos) << broken.before;
    text.replace(at, std::string(broken.before).size(), broken.after);
    folder.Write({{std::string("log/") + broken.file, text}});
    const Result<Recording> recording = ReadRecording(folder.path());
    ASSERT_FALSE(recording) << broken.complaint;
    EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(recording.error().message, ::testing::HasSubstr(broken.complaint));
    folder.Write({{std::string("log/") + broken.file, files.at(broken.file)}});
  }
}

// Damages every 11th byte of every file, and cuts every file there: an answer, whatever it is.
inline void ExpectSurvivesDamage(const LoggerFolder& folder, const std::string& recording,
                                 const Files& files) {
  for (const auto& [file, text] : files) {
    for (size_t at = 0; at < text.size(); at += 11) {
      std::string flipped = text;
      flipped[at] = static_cast<char>(flipped[at] ^ 0x15);
      for (const std::string& damaged : {flipped, text.substr(0, at)}) {
        folder.Write({{"log/" + file, damaged}});
        const Result<Recording> result = ReadRecording(folder.File(recording));
        if (result) continue;
        EXPECT_EQ(result.error().kind, ErrorKind::kBadInput);
        EXPECT_THAT(result.error().message, ::testing::HasSubstr(folder.path())) << file << at;
      }
    }
    folder.Write({{"log/" + file, text}});
  }
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_READERS_LOGGER_FOLDER_H_
