// The pictures of a recording, one after the other.
#ifndef CAMGYRO_FRONTEND_FRAME_SOURCE_H_
#define CAMGYRO_FRONTEND_FRAME_SOURCE_H_

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

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
  // The recording must outlive the source.
  explicit FrameSource(const Recording& recording) : recording_(recording) {}
  virtual ~FrameSource() = default;

  // Decodes the next frame of Recording::frames. False at the end of the recording; an error names
  // the file and what was wrong with it, a picture of another size than the camera's included.
  Result<bool> Next(cv::Mat* picture);

  // The same, but a picture of another size is no error: *picture is empty then, and *complaint
  // says which it was.
  Result<bool> NextOfAnySize(cv::Mat* picture, std::string* complaint);

  // Passes over frames, so that the next one is `frame` of Recording::frames; nothing where that
  // has gone by. Of a video, only what the frame needs is decoded, from the key picture before it.
  // Errors as of Next.
  virtual Status SkipTo(size_t frame);

 protected:
  struct Decoded {
    cv::Mat picture;
    int width_px = 0, height_px = 0;
    std::string place;  // "file: frame 3", for complaints
  };
  // Frame next_ as it is stored; false at the end.
  virtual Result<bool> Decode(Decoded* decoded) = 0;

  const Recording& recording_;
  size_t next_ = 0;  // of recording_.frames
};

// Opens the images or the video of a recording. The recording must outlive the source.
Result<std::unique_ptr<FrameSource>> OpenFrames(const Recording& recording,
                                                PictureFormat format = PictureFormat::kGray);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_FRAME_SOURCE_H_
