// The pictures of a recording, one after the other.
#ifndef CAMGYRO_FRONTEND_FRAME_SOURCE_H_
#define CAMGYRO_FRONTEND_FRAME_SOURCE_H_

#include <memory>
#include <opencv2/core/mat.hpp>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

enum class PictureFormat {
  kGray,  // 8-bit grey, height x width
  // 8-bit Y, then U and V at half the resolution, one below the other as OpenCV's COLOR_*_I420:
  // 3/2 height x width. Of odd sizes the last row or column is missing. Value ranges are the
  // video's own; of images they are those of BT.601 video.
  kI420,
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Decodes the next frame of Recording::frames. False at the end of the recording; an error names
  // the file and what was wrong with it.
  virtual Result<bool> Next(cv::Mat* picture) = 0;
};

// Opens the images or the video of a recording. The recording must outlive the source.
Result<std::unique_ptr<FrameSource>> OpenFrames(const Recording& recording,
                                                PictureFormat format = PictureFormat::kGray);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_FRAME_SOURCE_H_
