// The pictures of a recording, one after the other.
#ifndef CAMGYRO_FRONTEND_FRAME_SOURCE_H_
#define CAMGYRO_FRONTEND_FRAME_SOURCE_H_

#include <memory>
#include <opencv2/core/mat.hpp>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Decodes the next frame of Recording::frames as 8-bit grey. False at the end of the recording;
  // an error names the file and what was wrong with it.
  virtual Result<bool> Next(cv::Mat* gray) = 0;
};

// Opens the images or the video of a recording. The recording must outlive the source.
Result<std::unique_ptr<FrameSource>> OpenFrames(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_FRAME_SOURCE_H_
