#include "frontend/frame_source.h"

#include <utility>

#include "frontend/readers/ffmpeg.h"
#include "frontend/readers/image_file.h"
#include "frontend/readers/rosbag_reader.h"
#include "frontend/readers/text.h"
#include "frontend/readers/video_container.h"

namespace camgyro {
namespace {

class ImageFrames : public FrameSource {
 public:
  explicit ImageFrames(const Recording& recording) : recording_(recording) {}

  Result<bool> Next(cv::Mat* gray) override {
    if (next_ == recording_.frames.size()) return false;
    const std::string& file = recording_.frames[next_].image_file;
    Result<cv::Mat> image = ReadGrayImage(file);
    if (!image) return tl::unexpected(image.error());
    *gray = std::move(*image);
    if (gray->cols != recording_.camera.width_px || gray->rows != recording_.camera.height_px) {
      return BadInput(Concat(file, ": has ", gray->cols, " x ", gray->rows, " pixels, expected ",
                             recording_.camera.width_px, " x ", recording_.camera.height_px,
                             " as the frames before it"));
    }
    ++next_;
    return true;
  }

 private:
  const Recording& recording_;
  size_t next_ = 0;
};

class VideoFrames : public FrameSource {
 public:
  explicit VideoFrames(const Recording& recording)
      : recording_(recording), packet_(av_packet_alloc()), frame_(av_frame_alloc()) {}

  Status Open() {
    auto format = OpenContainer(File());
    if (!format) return tl::unexpected(format.error());
    format_ = std::move(*format);
    const AVCodec* codec = nullptr;
    stream_ = av_find_best_stream(format_.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_ < 0) {
      return BadInput(Concat(File(), ": its video cannot be decoded (", FfmpegError(stream_), ")"));
    }
    codec_.reset(avcodec_alloc_context3(codec));
    int code = avcodec_parameters_to_context(codec_.get(), format_->streams[stream_]->codecpar);
    if (code >= 0) code = avcodec_open2(codec_.get(), codec, nullptr);
    if (code < 0) {
      return BadInput(Concat(File(), ": its video cannot be decoded (", FfmpegError(code), ")"));
    }
    return {};
  }

  Result<bool> Next(cv::Mat* gray) override {
    const Result<bool> decoded = Decode();
    if (!decoded) return decoded;
    const size_t expected = recording_.frames.size();
    if (!*decoded) {
      if (next_ == expected) return false;
      return BadInput(
          Concat(File(), ": ends after frame ", next_, ", expected ", expected, " frames"));
    }
    if (next_ == expected) {
      return BadInput(
          Concat(File(), ": has a frame ", next_ + 1, ", expected ", expected, " frames"));
    }
    if (frame_->decode_error_flags != 0 || (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0) {
      return BadInput(Concat(File(), ": frame ", next_ + 1, " is damaged"));
    }
    if (frame_->width != recording_.camera.width_px ||
        frame_->height != recording_.camera.height_px) {
      return BadInput(Concat(File(), ": frame ", next_ + 1, " has ", frame_->width, " x ",
                             frame_->height, " pixels, expected ", recording_.camera.width_px,
                             " x ", recording_.camera.height_px));
    }
    ToGray(gray);
    av_frame_unref(frame_.get());
    ++next_;
    return true;
  }

 private:
  const std::string& File() const { return recording_.video_file; }

  // The next picture into frame_; false at the end of the file.
  Result<bool> Decode() {
    for (;;) {
      int code = avcodec_receive_frame(codec_.get(), frame_.get());
      if (code >= 0) return true;
      if (code == AVERROR_EOF) return false;
      if (code == AVERROR(EAGAIN)) code = SendPacket();
      if (code < 0) {
        return BadInput(
            Concat(File(), ": frame ", next_ + 1, " cannot be decoded (", FfmpegError(code), ")"));
      }
    }
  }

  // Feeds the decoder the next packet of the video, or tells it that there is none.
  int SendPacket() {
    int code = 0;
    while ((code = av_read_frame(format_.get(), packet_.get())) >= 0) {
      const bool video = packet_->stream_index == stream_;
      if (video) code = avcodec_send_packet(codec_.get(), packet_.get());
      av_packet_unref(packet_.get());
      if (video) return code;
    }
    return code == AVERROR_EOF ? avcodec_send_packet(codec_.get(), nullptr) : code;
  }

  void ToGray(cv::Mat* gray) {
    gray->create(frame_->height, frame_->width, CV_8UC1);
    to_gray_.reset(sws_getCachedContext(to_gray_.release(), frame_->width, frame_->height,
                                        static_cast<AVPixelFormat>(frame_->format), frame_->width,
                                        frame_->height, AV_PIX_FMT_GRAY8, SWS_POINT, nullptr,
                                        nullptr, nullptr));
    uint8_t* planes[4] = {gray->data, nullptr, nullptr, nullptr};
    const int strides[4] = {static_cast<int>(gray->step), 0, 0, 0};
    sws_scale(to_gray_.get(), frame_->data, frame_->linesize, 0, frame_->height, planes, strides);
  }

  const Recording& recording_;
  FfmpegPtr<AVFormatContext> format_;
  FfmpegPtr<AVCodecContext> codec_;
  FfmpegPtr<SwsContext> to_gray_;
  FfmpegPtr<AVPacket> packet_;
  FfmpegPtr<AVFrame> frame_;
  int stream_ = -1;
  size_t next_ = 0;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenFrames(const Recording& recording) {
  if (!recording.HasImages()) {
    return BadInput(Concat(recording.path, ": has no pictures, expected images or a video"));
  }
  if (recording.video_file.empty()) return std::make_unique<ImageFrames>(recording);
  if (IsRosbag(recording.video_file)) return OpenRosbagFrames(recording);
  auto frames = std::make_unique<VideoFrames>(recording);
  if (Status status = frames->Open(); !status) return tl::unexpected(status.error());
  return frames;
}

}  // namespace camgyro
