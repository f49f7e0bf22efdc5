#include "tests/frontend/readers/write_video.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}

#include <cstring>

namespace camgyro {
namespace {

constexpr AVRational kMillisecond = {1, 1000};

// Takes all packets that the encoder has ready into the file.
bool Drain(AVCodecContext* encoder, AVFormatContext* out, AVPacket* packet) {
  int code = 0;
  while ((code = avcodec_receive_packet(encoder, packet)) >= 0) {
    av_packet_rescale_ts(packet, encoder->time_base, out->streams[0]->time_base);
    packet->stream_index = 0;
    packet->duration = av_rescale_q(1, encoder->time_base, out->streams[0]->time_base);
    if (av_interleaved_write_frame(out, packet) < 0) return false;
  }
  return code == AVERROR(EAGAIN) || code == AVERROR_EOF;
}

bool WriteGpmf(const VideoSpec& spec, AVFormatContext* out, AVPacket* packet) {
  for (const auto& [bytes, start_s] : spec.gpmf) {
    if (av_new_packet(packet, static_cast<int>(bytes.size())) < 0) return false;
    std::memcpy(packet->data, bytes.data(), bytes.size());
    packet->stream_index = 1;
    packet->pts = packet->dts = av_rescale_q(static_cast<int64_t>(start_s * 1000.0), kMillisecond,
                                             out->streams[1]->time_base);
    packet->duration = av_rescale_q(1000, kMillisecond, out->streams[1]->time_base);
    packet->flags |= AV_PKT_FLAG_KEY;
    if (av_interleaved_write_frame(out, packet) < 0) return false;
  }
  return true;
}

bool Write(const VideoSpec& spec, AVFormatContext* out, AVCodecContext* encoder, AVFrame* frame,
           AVPacket* packet) {
  encoder->width = spec.pictures[0].cols;
  encoder->height = spec.pictures[0].rows;
  encoder->pix_fmt = AV_PIX_FMT_YUV420P;
  encoder->time_base = {1, spec.frames_per_second};
  encoder->flags |= AV_CODEC_FLAG_QSCALE | AV_CODEC_FLAG_GLOBAL_HEADER;
  encoder->global_quality = 2 * FF_QP2LAMBDA;
  if (avcodec_open2(encoder, nullptr, nullptr) < 0) return false;
  AVStream* video = avformat_new_stream(out, nullptr);
  video->time_base = encoder->time_base;
  if (avcodec_parameters_from_context(video->codecpar, encoder) < 0) return false;
  if (spec.rotation_deg != 0) {
    auto* matrix = reinterpret_cast<int32_t*>(
        av_stream_new_side_data(video, AV_PKT_DATA_DISPLAYMATRIX, 9 * sizeof(int32_t)));
    av_display_rotation_set(matrix, spec.rotation_deg);
  }
  if (!spec.gpmf.empty()) {
    AVStream* data = avformat_new_stream(out, nullptr);
    data->codecpar->codec_type = AVMEDIA_TYPE_DATA;
    data->codecpar->codec_id = AV_CODEC_ID_BIN_DATA;
    data->codecpar->codec_tag = MKTAG('g', 'p', 'm', 'd');
    data->time_base = kMillisecond;
  }
  AVDictionary* options = nullptr;
  if (spec.index_first) av_dict_set(&options, "movflags", "faststart", 0);
  const int header = avformat_write_header(out, &options);
  av_dict_free(&options);
  if (header < 0) return false;

  frame->width = encoder->width;
  frame->height = encoder->height;
  frame->format = encoder->pix_fmt;
  frame->quality = encoder->global_quality;
  if (av_frame_get_buffer(frame, 0) < 0) return false;
  for (size_t i = 0; i < spec.pictures.size(); ++i) {
    if (av_frame_make_writable(frame) < 0) return false;
    for (int row = 0; row < frame->height; ++row) {
      const uint8_t* gray = spec.pictures[i].ptr(row);
      uint8_t* luma = frame->data[0] + row * frame->linesize[0];
      // Luma of videos spans 16 to 235.
      for (int col = 0; col < frame->width; ++col) {
        luma[col] = static_cast<uint8_t>(16 + (219 * gray[col] + 127) / 255);
      }
    }
    for (int plane : {1, 2}) {
      std::memset(frame->data[plane], 128, frame->linesize[plane] * frame->height / 2);
    }
    frame->pts = static_cast<int64_t>(i);
    if (avcodec_send_frame(encoder, frame) < 0 || !Drain(encoder, out, packet)) return false;
  }
  return avcodec_send_frame(encoder, nullptr) >= 0 && Drain(encoder, out, packet) &&
         WriteGpmf(spec, out, packet) && av_write_trailer(out) >= 0;
}

}  // namespace

bool WriteVideo(const std::string& file, const VideoSpec& spec) {
  AVFormatContext* out = nullptr;
  if (avformat_alloc_output_context2(&out, nullptr, "mp4", file.c_str()) < 0) return false;
  AVCodecContext* encoder = avcodec_alloc_context3(avcodec_find_encoder(AV_CODEC_ID_MPEG4));
  AVFrame* frame = av_frame_alloc();
  AVPacket* packet = av_packet_alloc();
  const bool written = avio_open(&out->pb, file.c_str(), AVIO_FLAG_WRITE) >= 0 &&
                       Write(spec, out, encoder, frame, packet);
  av_packet_free(&packet);
  av_frame_free(&frame);
  avcodec_free_context(&encoder);
  avio_closep(&out->pb);
  avformat_free_context(out);
  return written;
}

}  // namespace camgyro
