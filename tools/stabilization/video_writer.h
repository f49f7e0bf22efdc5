// Writes pictures as an H.264 video, and the sound of another file beside them.
#ifndef CAMGYRO_TOOLS_STABILIZATION_VIDEO_WRITER_H_
#define CAMGYRO_TOOLS_STABILIZATION_VIDEO_WRITER_H_

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "core/result.h"

namespace camgyro {

struct VideoWriterOptions {
  int width_px = 0, height_px = 0;  // even
  double rate_hz = 30.0;            // nominal; frames have stamps of their own
  int crf = 18;                     // quality of x264, 0 (lossless) to 51
  // The video that the pictures came from, if any: its colours' meaning, its display rotation and
  // its sound are kept.
  std::string source_file;
  double source_start_s = 0.0;  // time in the source that is time 0 here
};

class VideoWriter {
 public:
  // `container`: extension of the kind of file, "mp4", "mov" or "mkv"; `file` may be named
  // differently.
  static Result<std::unique_ptr<VideoWriter>> Open(const std::string& file,
                                                   const std::string& container,
                                                   const VideoWriterOptions& options);
  ~VideoWriter();

  // A picture in PictureFormat::kI420 at a time from the first one, increasing.
  Status Write(const cv::Mat& i420, int64_t stamp_ns);
  // Writes what is still inside, and the index. A file without is not playable.
  Status Close();

  // What became of the sound: "none", "copied", or why it could not be.
  const std::string& sound() const;

 private:
  struct Impl;
  explicit VideoWriter(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_STABILIZATION_VIDEO_WRITER_H_
