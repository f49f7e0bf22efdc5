#include "simulation/video_encoder.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace camgyro::simulation {
namespace {

constexpr AVRational kTimeBase = {1, 90000};
constexpr AVRational kNanoseconds = {1, 1000000000};

}  // namespace

struct VideoEncoder::Impl {
  std::string file;
  AVFormatContext* format = nullptr;
  AVCodecContext* codec = nullptr;
  AVStream* stream = nullptr;
  AVFrame* frame = nullptr;
  AVPacket* packet = nullptr;
  std::optional<int64_t> first_ns;
  int64_t interval = 0;  // nominal, in kTimeBase
  int64_t last = -1;     // time of the last picture, in kTimeBase

  ~Impl() {
    av_packet_free(&packet);
    av_frame_free(&frame);
    avcodec_free_context(&codec);
    if (format != nullptr) avio_closep(&format->pb);
    avformat_free_context(format);
  }

  Status Check(int code, const char* what) const {
    if (code >= 0) return {};
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(code, text, sizeof text);
    return BadInput(file + ": " + what + ": " + text);
  }
};

VideoEncoder::VideoEncoder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VideoEncoder::~VideoEncoder() = default;

Result<std::unique_ptr<VideoEncoder>> VideoEncoder::Open(const std::string& file, int width_px,
                                                         int height_px, double rate_hz, int crf) {
  auto impl = std::make_unique<Impl>();
  impl->file = file;
  if (width_px % 2 != 0 || height_px % 2 != 0) {
    return BadInput(file + ": H.264 needs an even width and height");
  }
  const AVCodec* x264 = avcodec_find_encoder_by_name("libx264");
  if (x264 == nullptr) {
    return BadInput(file + ": this FFmpeg has no libx264; use video.format: png");
  }
  av_log_set_level(AV_LOG_ERROR);
  Status status = impl->Check(
      avformat_alloc_output_context2(&impl->format, nullptr, "mp4", file.c_str()), "mp4");
  if (!status) return tl::unexpected(status.error());
  impl->format->flags |= AVFMT_FLAG_BITEXACT;
  impl->stream = avformat_new_stream(impl->format, nullptr);
  AVCodecContext* codec = impl->codec = avcodec_alloc_context3(x264);
  codec->width = width_px;
  codec->height = height_px;
  codec->pix_fmt = AV_PIX_FMT_YUV420P;
  codec->color_range = AVCOL_RANGE_JPEG;  // grey 0 to 255
  codec->time_base = kTimeBase;
  codec->framerate = av_d2q(rate_hz, 100000);
  codec->max_b_frames = 0;  // packets in the order of frames, as phones do
  codec->gop_size = 60;
  codec->thread_count = 1;
  codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
  av_opt_set_int(codec->priv_data, "crf", crf, 0);
  av_opt_set(codec->priv_data, "preset", "medium", 0);
  status = impl->Check(avcodec_open2(codec, x264, nullptr), "cannot open libx264");
  if (status) {
    impl->stream->time_base = kTimeBase;
    status = impl->Check(avcodec_parameters_from_context(impl->stream->codecpar, codec), "stream");
  }
  if (status) {
    status = impl->Check(avio_open(&impl->format->pb, file.c_str(), AVIO_FLAG_WRITE),
                         "cannot be written");
  }
  if (status) status = impl->Check(avformat_write_header(impl->format, nullptr), "header");
  if (!status) return tl::unexpected(status.error());
  impl->interval = std::llround(kTimeBase.den / rate_hz);
  impl->packet = av_packet_alloc();
  impl->frame = av_frame_alloc();
  impl->frame->format = codec->pix_fmt;
  impl->frame->width = width_px;
  impl->frame->height = height_px;
  status = impl->Check(av_frame_get_buffer(impl->frame, 0), "out of memory");
  if (!status) return tl::unexpected(status.error());
  return std::unique_ptr<VideoEncoder>(new VideoEncoder(std::move(impl)));
}

Status VideoEncoder::Write(const cv::Mat& gray, int64_t stamp_ns) {
  AVFrame* frame = impl_->frame;
  Status status = impl_->Check(av_frame_make_writable(frame), "out of memory");
  if (!status) return status;
  for (int v = 0; v < gray.rows; ++v) {
    std::memcpy(frame->data[0] + static_cast<ptrdiff_t>(v) * frame->linesize[0], gray.ptr(v),
                static_cast<size_t>(gray.cols));
  }
  for (const int plane : {1, 2}) {
    std::memset(frame->data[plane], 128,
                static_cast<size_t>(frame->linesize[plane]) * static_cast<size_t>(gray.rows / 2));
  }
  if (!impl_->first_ns) impl_->first_ns = stamp_ns;
  // Of two that came within 11 us of each other, the second is a unit later: no file has two
  // pictures of one time.
  frame->pts = impl_->last =
      std::max(impl_->last + 1, av_rescale_q(stamp_ns - *impl_->first_ns, kNanoseconds, kTimeBase));
  return Send(/*flush=*/false);
}

Status VideoEncoder::Send(bool flush) {
  Status status =
      impl_->Check(avcodec_send_frame(impl_->codec, flush ? nullptr : impl_->frame), "encoding");
  while (status) {
    const int code = avcodec_receive_packet(impl_->codec, impl_->packet);
    if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) break;
    status = impl_->Check(code, "encoding");
    if (!status) break;
    impl_->packet->duration = impl_->interval;  // the last frame is not shown without one
    av_packet_rescale_ts(impl_->packet, kTimeBase, impl_->stream->time_base);
    status = impl_->Check(av_interleaved_write_frame(impl_->format, impl_->packet), "writing");
  }
  return status;
}

Status VideoEncoder::Close() {
  Status status = Send(/*flush=*/true);
  if (status) status = impl_->Check(av_write_trailer(impl_->format), "writing the index");
  return status;
}

}  // namespace camgyro::simulation
