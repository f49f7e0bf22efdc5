// Writes small MP4 files for tests: MPEG-4 pictures, and telemetry packets like a GoPro's.
#ifndef CAMGYRO_TESTS_FRONTEND_READERS_WRITE_VIDEO_H_
#define CAMGYRO_TESTS_FRONTEND_READERS_WRITE_VIDEO_H_

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

namespace camgyro {

struct VideoSpec {
  std::vector<cv::Mat> pictures;  // 8-bit grey, all of one even size
  int frames_per_second = 25;
  int rotation_deg = 0;  // display matrix, clockwise
  bool index_first = false;
  // Content and start [s] of the packets of a `gpmd` stream; none without.
  std::vector<std::pair<std::string, double>> gpmf;
};

// True on success.
bool WriteVideo(const std::string& file, const VideoSpec& spec);

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_READERS_WRITE_VIDEO_H_
