// Writes grey pictures as an H.264 video in an MP4 file.
#ifndef CAMGYRO_SIMULATION_VIDEO_ENCODER_H_
#define CAMGYRO_SIMULATION_VIDEO_ENCODER_H_

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "core/result.h"

namespace camgyro::simulation {

// One thread and no time of day in the file: the same pictures give the same bytes.
class VideoEncoder {
 public:
  // crf: quality of x264, 0 (lossless) to 51. Width and height must be even.
  static Result<std::unique_ptr<VideoEncoder>> Open(const std::string& file, int width_px,
                                                    int height_px, double rate_hz, int crf);
  ~VideoEncoder();

  // 8-bit grey; stamps must increase. The file's time is relative to the first one.
  Status Write(const cv::Mat& gray, int64_t stamp_ns);
  // Writes what is still inside, and the index. A file without is not playable.
  Status Close();

 private:
  struct Impl;
  explicit VideoEncoder(std::unique_ptr<Impl> impl);
  Status Send(bool flush);

  std::unique_ptr<Impl> impl_;
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_VIDEO_ENCODER_H_
