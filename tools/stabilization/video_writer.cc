#include "tools/stabilization/video_writer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "frontend/readers/ffmpeg.h"
#include "frontend/readers/video_container.h"

extern "C" {
#include <libavutil/opt.h>
}

namespace camgyro {
namespace {

constexpr AVRational kTimeBase = {1, 90000};
constexpr AVRational kNanoseconds = {1, 1000000000};

}  // namespace

struct VideoWriter::Impl {
  std::string file;
  AVFormatContext* format = nullptr;  // owned; not an input, which FfmpegPtr would close
  FfmpegPtr<AVCodecContext> codec;
  FfmpegPtr<AVFrame> frame{av_frame_alloc()};
  FfmpegPtr<AVPacket> packet{av_packet_alloc()};
  AVStream* video = nullptr;
  int64_t interval = 0;  // nominal, in kTimeBase
  int64_t last = -1;     // time of the last picture, in kTimeBase

  FfmpegPtr<AVFormatContext> source;
  int sound_index = -1;  // in the source
  AVStream* sound = nullptr;
  FfmpegPtr<AVPacket> sound_packet{av_packet_alloc()};
  bool sound_pending = false;  // sound_packet holds one that is later than the last picture
  double source_start_s = 0.0;
  std::string sound_note = "none";

  ~Impl() {
    if (format != nullptr) avio_closep(&format->pb);
    avformat_free_context(format);
  }

  Status Check(int code, const char* what) const {
    if (code >= 0) return {};
    return BadInput(file + ": " + what + ": " + FfmpegError(code));
  }

  void CopyColours(const AVCodecParameters& from) {
    codec->color_range = from.color_range;
    codec->color_primaries = from.color_primaries;
    codec->color_trc = from.color_trc;
    codec->colorspace = from.color_space;
    codec->chroma_sample_location = from.chroma_location;
  }

  // Opens the source, if there is one, before the encoder is opened.
  Status OpenSource(const std::string& source_file, int* video_index) {
    auto opened = OpenContainer(source_file);
    if (!opened) return tl::unexpected(opened.error());
    source = std::move(*opened);
    *video_index = av_find_best_stream(source.get(), AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    sound_index = av_find_best_stream(source.get(), AVMEDIA_TYPE_AUDIO, -1, -1, nullptr, 0);
    return {};
  }

  Status AddSound() {
    if (sound_index < 0) return {};
    const AVCodecParameters* from = source->streams[sound_index]->codecpar;
    if (avformat_query_codec(format->oformat, from->codec_id, FF_COMPLIANCE_NORMAL) != 1) {
      sound_note = std::string("left out: ") + avcodec_get_name(from->codec_id) +
                   " sound does not go into a file of this kind; try another one (.mov, .mkv)";
      sound_index = -1;
      return {};
    }
    sound = avformat_new_stream(format, nullptr);
    const Status copied =
        Check(avcodec_parameters_copy(sound->codecpar, from), "cannot copy the sound");
    sound->codecpar->codec_tag = 0;  // of the other container
    sound->time_base = source->streams[sound_index]->time_base;
    sound_note = "copied";
    return copied;
  }

  // Copies sound up to a time; AV_NOPTS_VALUE: all there is.
  Status CopySound(double until_s) {
    while (sound != nullptr) {
      if (!sound_pending) {
        if (av_read_frame(source.get(), sound_packet.get()) < 0) break;  // the end
        if (sound_packet->stream_index != sound_index || sound_packet->pts == AV_NOPTS_VALUE) {
          av_packet_unref(sound_packet.get());
          continue;
        }
      }
      const AVRational base = source->streams[sound_index]->time_base;
      const double time_s = static_cast<double>(sound_packet->pts) * av_q2d(base) - source_start_s;
      sound_pending = time_s > until_s;
      if (sound_pending) break;
      if (time_s < 0.0) {
        av_packet_unref(sound_packet.get());
        continue;
      }
      const int64_t shift = std::llround(source_start_s / av_q2d(base));
      sound_packet->pts -= shift;
      sound_packet->dts -= shift;
      av_packet_rescale_ts(sound_packet.get(), base, sound->time_base);
      sound_packet->stream_index = sound->index;
      sound_packet->pos = -1;
      const Status written =
          Check(av_interleaved_write_frame(format, sound_packet.get()), "writing the sound");
      if (!written) return written;
    }
    return {};
  }

  Status Send(bool flush) {
    Status status =
        Check(avcodec_send_frame(codec.get(), flush ? nullptr : frame.get()), "encoding");
    while (status) {
      const int code = avcodec_receive_packet(codec.get(), packet.get());
      if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) break;
      status = Check(code, "encoding");
      if (!status) break;
      packet->duration = interval;  // the last picture is not shown without one
      packet->stream_index = video->index;
      av_packet_rescale_ts(packet.get(), kTimeBase, video->time_base);
      status = Check(av_interleaved_write_frame(format, packet.get()), "writing");
    }
    return status;
  }
};

VideoWriter::VideoWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VideoWriter::~VideoWriter() = default;

Result<std::unique_ptr<VideoWriter>> VideoWriter::Open(const std::string& file,
                                                       const std::string& container,
                                                       const VideoWriterOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->file = file;
  impl->source_start_s = options.source_start_s;
  const AVCodec* x264 = avcodec_find_encoder_by_name("libx264");
  if (x264 == nullptr) return BadInput(file + ": this FFmpeg has no libx264 to encode video with");
  const char* kind = container == "mkv" ? "matroska" : container == "mov" ? "mov" : "mp4";
  Status status =
      impl->Check(avformat_alloc_output_context2(&impl->format, nullptr, kind, file.c_str()), kind);
  if (!status) return tl::unexpected(status.error());
  impl->format->flags |= AVFMT_FLAG_BITEXACT;  // no time of day in the file
  impl->video = avformat_new_stream(impl->format, nullptr);
  impl->codec.reset(avcodec_alloc_context3(x264));
  AVCodecContext* codec = impl->codec.get();
  codec->width = options.width_px;
  codec->height = options.height_px;
  codec->pix_fmt = AV_PIX_FMT_YUV420P;
  codec->time_base = kTimeBase;
  codec->framerate = av_d2q(options.rate_hz, 100000);
  codec->thread_count = 2;  // a fixed number: it is part of what makes the bytes
  codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
  av_opt_set_int(codec->priv_data, "crf", options.crf, 0);
  av_opt_set(codec->priv_data, "preset", "veryfast", 0);
  int source_video = -1;
  if (!options.source_file.empty()) {
    status = impl->OpenSource(options.source_file, &source_video);
    if (status && source_video >= 0) {
      impl->CopyColours(*impl->source->streams[source_video]->codecpar);
    }
  } else {
    codec->color_range = AVCOL_RANGE_MPEG;
    codec->colorspace = AVCOL_SPC_SMPTE170M;  // BT.601, as PictureFormat::kI420 says
  }
  if (status) status = impl->Check(avcodec_open2(codec, x264, nullptr), "cannot open libx264");
  if (status) {
    impl->video->time_base = kTimeBase;
    status = impl->Check(avcodec_parameters_from_context(impl->video->codecpar, codec), "stream");
  }
  if (status && source_video >= 0) {
    size_t size = 0;
    const uint8_t* matrix = av_stream_get_side_data(impl->source->streams[source_video],
                                                    AV_PKT_DATA_DISPLAYMATRIX, &size);
    uint8_t* copy = matrix == nullptr
                        ? nullptr
                        : av_stream_new_side_data(impl->video, AV_PKT_DATA_DISPLAYMATRIX, size);
    if (copy != nullptr) std::memcpy(copy, matrix, size);
  }
  if (status) status = impl->AddSound();
  if (status) {
    status = impl->Check(avio_open(&impl->format->pb, file.c_str(), AVIO_FLAG_WRITE),
                         "cannot be written");
  }
  if (status) status = impl->Check(avformat_write_header(impl->format, nullptr), "header");
  if (!status) return tl::unexpected(status.error());
  impl->interval = std::llround(kTimeBase.den / options.rate_hz);
  impl->frame->format = codec->pix_fmt;
  impl->frame->width = options.width_px;
  impl->frame->height = options.height_px;
  status = impl->Check(av_frame_get_buffer(impl->frame.get(), 0), "out of memory");
  if (!status) return tl::unexpected(status.error());
  return std::unique_ptr<VideoWriter>(new VideoWriter(std::move(impl)));
}

Status VideoWriter::Write(const cv::Mat& i420, int64_t stamp_ns) {
  AVFrame* frame = impl_->frame.get();
  Status status = impl_->CopySound(1e-9 * static_cast<double>(stamp_ns));
  if (status) status = impl_->Check(av_frame_make_writable(frame), "out of memory");
  if (!status) return status;
  const uint8_t* from = i420.data;
  for (int plane = 0; plane < 3; ++plane) {
    const int rows = plane == 0 ? frame->height : frame->height / 2;
    const int columns = plane == 0 ? frame->width : frame->width / 2;
    for (int row = 0; row < rows; ++row, from += columns) {
      std::memcpy(frame->data[plane] + static_cast<ptrdiff_t>(row) * frame->linesize[plane], from,
                  static_cast<size_t>(columns));
    }
  }
  // Of two that came within 11 us of each other, the second is a unit later: no file has two
  // pictures of one time.
  frame->pts = impl_->last =
      std::max(impl_->last + 1, av_rescale_q(stamp_ns, kNanoseconds, kTimeBase));
  return impl_->Send(/*flush=*/false);
}

Status VideoWriter::Close() {
  Status status = impl_->Send(/*flush=*/true);
  // Sound goes on to the end of the last picture, which CopySound has been asked for already.
  if (status) status = impl_->Check(av_write_trailer(impl_->format), "writing the index");
  return status;
}

const std::string& VideoWriter::sound() const { return impl_->sound_note; }

}  // namespace camgyro
