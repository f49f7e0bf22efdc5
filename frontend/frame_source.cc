#include "frontend/frame_source.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/readers/ffmpeg.h"
#include "frontend/readers/formats.h"
#include "frontend/readers/image_file.h"
#include "frontend/readers/text.h"
#include "frontend/readers/video_container.h"

namespace camgyro {
namespace {

class ImageFrames : public FrameSource {
 public:
  ImageFrames(const Recording& recording, PictureFormat format)
      : FrameSource(recording), format_(format) {}

  Status SkipTo(size_t frame) override {
    next_ = std::max(next_, std::min(frame, recording_.frames.size()));
    return {};
  }

 protected:
  Result<bool> Decode(Decoded* decoded) override {
    if (next_ == recording_.frames.size()) return false;
    const std::string& file = recording_.frames[next_].image_file;
    const bool gray = format_ == PictureFormat::kGray;
    Result<cv::Mat> image = gray ? ReadGrayImage(file) : ReadColourImage(file);
    if (!image) return tl::unexpected(image.error());
    decoded->width_px = image->cols;
    decoded->height_px = image->rows;
    decoded->place = Concat(file, ": frame ", next_ + 1);
    if (gray) {
      decoded->picture = std::move(*image);
    } else {
      const cv::Rect even(0, 0, image->cols & ~1, image->rows & ~1);
      cv::cvtColor((*image)(even), decoded->picture, cv::COLOR_BGR2YUV_I420);
    }
    return true;
  }

 private:
  const PictureFormat format_;
};

class VideoFrames : public FrameSource {
 public:
  VideoFrames(const Recording& recording, PictureFormat picture_format)
      : FrameSource(recording),
        picture_format_(picture_format),
        packet_(av_packet_alloc()),
        frame_(av_frame_alloc()) {}

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

  Status SkipTo(size_t frame) override {
    if (frame <= next_ || frame >= recording_.frames.size()) return FrameSource::SkipTo(frame);
    const size_t picture = recording_.PictureOf(frame);
    const std::optional<int64_t> time = TimeOf(picture);
    if (!time) return FrameSource::SkipTo(frame);
    if (!Seek(*time)) {  // somewhere in the file now: from its beginning
      if (Status opened = Open(); !opened) return opened;
      pictures_ = next_ = 0;
      return FrameSource::SkipTo(frame);
    }
    at_picture_ = true;
    pictures_ = picture;
    next_ = frame;
    return {};
  }

 protected:
  Result<bool> Decode(Decoded* decoded) override {
    const size_t expected = recording_.frames.size();
    // The video may go on with pictures that were left out.
    if (next_ == expected && expected > 0 && recording_.frames.back().picture >= 0) return false;
    do {
      const Result<bool> received = Receive();
      if (!received) return received;
      if (!*received) {
        if (next_ == expected) return false;
        return BadInput(
            Concat(File(), ": ends after frame ", next_, ", expected ", expected, " frames"));
      }
      ++pictures_;
    } while (next_ < expected && pictures_ <= recording_.PictureOf(next_));
    if (next_ == expected) {
      return BadInput(
          Concat(File(), ": has a frame ", next_ + 1, ", expected ", expected, " frames"));
    }
    if (Damaged()) {
      return BadInput(Concat(File(), ": frame ", next_ + 1, " is damaged"));
    }
    decoded->width_px = frame_->width;
    decoded->height_px = frame_->height;
    decoded->place = Concat(File(), ": frame ", pictures_);
    if (Status converted = Convert(&decoded->picture); !converted) {
      return tl::unexpected(converted.error());
    }
    av_frame_unref(frame_.get());
    return true;
  }

 private:
  const std::string& File() const { return recording_.video_file; }

  bool Damaged() const {
    return frame_->decode_error_flags != 0 || (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0;
  }

  // The time of a picture in the stream's units. Nothing where the file does not say it.
  std::optional<int64_t> TimeOf(size_t picture) {
    if (!stamps_ns_) {
      const Result<VideoContainer> container = ReadVideoContainer(File());
      stamps_ns_ = container ? container->stamps_ns : std::vector<int64_t>();
    }
    if (picture >= stamps_ns_->size()) return std::nullopt;
    return av_rescale_q((*stamps_ns_)[picture], AVRational{1, 1000000000},
                        format_->streams[stream_]->time_base);
  }

  // Decodes up to the picture of that time, from the key picture before. False if it is not there.
  bool Seek(int64_t time) {
    if (av_seek_frame(format_.get(), stream_, time, AVSEEK_FLAG_BACKWARD) < 0) return false;
    avcodec_flush_buffers(codec_.get());
    for (;;) {
      const Result<bool> received = Receive();
      if (!received || !*received || frame_->pts > time) return false;
      if (frame_->pts == time) return !Damaged();
    }
  }

  // The next picture into frame_; false at the end of the file.
  Result<bool> Receive() {
    if (std::exchange(at_picture_, false)) return true;
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

  Status Convert(cv::Mat* picture) {
    if (picture_format_ == PictureFormat::kGray) {
      ToGray(picture);
      return {};
    }
    const auto from = static_cast<AVPixelFormat>(frame_->format);
    const AVFrame* i420 = frame_.get();
    // The J format is the same with a full range of values, which stays as it is.
    if (from != AV_PIX_FMT_YUV420P && from != AV_PIX_FMT_YUVJ420P) {
      // Into a frame of FFmpeg's, whose rows have the padding that swscale may write to.
      converted_.reset(av_frame_alloc());
      converted_->format = AV_PIX_FMT_YUV420P;
      converted_->width = frame_->width;
      converted_->height = frame_->height;
      const int code = av_frame_get_buffer(converted_.get(), 0);
      if (code < 0) return BadInput(Concat(File(), ": ", FfmpegError(code)));
      to_i420_.reset(sws_getCachedContext(to_i420_.release(), frame_->width, frame_->height, from,
                                          frame_->width, frame_->height, AV_PIX_FMT_YUV420P,
                                          SWS_BILINEAR, nullptr, nullptr, nullptr));
      sws_scale(to_i420_.get(), frame_->data, frame_->linesize, 0, frame_->height, converted_->data,
                converted_->linesize);
      i420 = converted_.get();
    }
    const int width = frame_->width & ~1, height = frame_->height & ~1;
    picture->create(height + height / 2, width, CV_8UC1);
    uint8_t* to = picture->data;
    for (int plane = 0; plane < 3; ++plane) {
      const int rows = plane == 0 ? height : height / 2, columns = plane == 0 ? width : width / 2;
      for (int row = 0; row < rows; ++row, to += columns) {
        std::memcpy(to, i420->data[plane] + static_cast<ptrdiff_t>(row) * i420->linesize[plane],
                    static_cast<size_t>(columns));
      }
    }
    return {};
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

  const PictureFormat picture_format_;
  FfmpegPtr<AVFormatContext> format_;
  FfmpegPtr<AVCodecContext> codec_;
  FfmpegPtr<SwsContext> to_gray_, to_i420_;
  FfmpegPtr<AVPacket> packet_;
  FfmpegPtr<AVFrame> frame_, converted_;
  int stream_ = -1;
  std::optional<std::vector<int64_t>> stamps_ns_;  // of all pictures, once they were needed
  size_t pictures_ = 0;                            // received
  bool at_picture_ = false;                        // frame_ holds the one that Receive is to give
};

}  // namespace

Result<bool> FrameSource::NextOfAnySize(cv::Mat* picture, std::string* complaint) {
  Decoded decoded;
  decoded.picture = std::move(*picture);  // its memory is used again
  const Result<bool> more = Decode(&decoded);
  if (!more || !*more) return more;
  ++next_;
  const CameraGuess& camera = recording_.camera;
  if (decoded.width_px == camera.width_px && decoded.height_px == camera.height_px) {
    *picture = std::move(decoded.picture);
  } else {
    *complaint = Concat(decoded.place, " has ", decoded.width_px, " x ", decoded.height_px,
                        " pixels, expected ", camera.width_px, " x ", camera.height_px);
    picture->release();
  }
  return true;
}

Status FrameSource::SkipTo(size_t frame) {
  cv::Mat passed;
  std::string complaint;
  while (next_ < frame) {
    const Result<bool> more = NextOfAnySize(&passed, &complaint);
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
  }
  return {};
}

Result<bool> FrameSource::Next(cv::Mat* picture) {
  std::string complaint;
  const Result<bool> more = NextOfAnySize(picture, &complaint);
  if (!complaint.empty()) return BadInput(complaint);
  return more;
}

Result<std::unique_ptr<FrameSource>> OpenFrames(const Recording& recording, PictureFormat format) {
  if (!recording.HasImages()) {
    return BadInput(Concat(recording.path, ": has no pictures, expected images or a video"));
  }
  if (recording.video_file.empty()) return std::make_unique<ImageFrames>(recording, format);
  try {
    const RecordingFormat* container = FindFormat(recording.video_file);
    if (container != nullptr && container->open_frames != nullptr) {
      if (format == PictureFormat::kGray) return container->open_frames(recording);
      return BadInput(Concat(recording.path, ": pictures of a bag are read in grey only"));
    }
  } catch (const std::filesystem::filesystem_error& error) {  // of folders that may not be read
    return BadInput(Concat(recording.video_file, ": ", error.code().message()));
  }
  auto frames = std::make_unique<VideoFrames>(recording, format);
  if (Status status = frames->Open(); !status) return tl::unexpected(status.error());
  return frames;
}

}  // namespace camgyro
