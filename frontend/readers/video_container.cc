#include "frontend/readers/video_container.h"

extern "C" {
#include <libavutil/dict.h>
#include <libavutil/display.h>
#include <libavutil/log.h>
#include <libavutil/mem.h>
}

#include <algorithm>
#include <cmath>

#include "frontend/readers/bytes.h"
#include "frontend/readers/text.h"
#include "frontend/readers/whole_file.h"

namespace camgyro {
namespace {

bool IsGpmf(const AVStream& stream) {
  return stream.codecpar->codec_type == AVMEDIA_TYPE_DATA &&
         stream.codecpar->codec_tag == MKTAG('g', 'p', 'm', 'd');
}

// Whatever its name says, FFmpeg takes a file for what it begins like: also for a playlist, whose
// videos can be anywhere, or on the network. These hold their pictures themselves.
constexpr char kContainers[] = "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mxf";

int DisplayRotationDeg(const AVStream& stream) {
  const uint8_t* matrix = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (matrix == nullptr) return 0;
  const double angle_deg = av_display_rotation_get(reinterpret_cast<const int32_t*>(matrix));
  return std::isfinite(angle_deg) ? static_cast<int>(std::lround(-angle_deg)) : 0;
}

}  // namespace

Result<FfmpegPtr<AVFormatContext>> OpenContainer(const std::string& file) {
  if (Status is_file = CheckIsFile(file); !is_file) return tl::unexpected(is_file.error());
  av_log_set_level(AV_LOG_FATAL);
  av_max_alloc(kLargestRecord);  // a few bytes of a header can claim 2 GiB
  AVFormatContext* context = nullptr;
  AVDictionary* options = nullptr;
  av_dict_set(&options, "format_whitelist", kContainers, 0);
  av_dict_set(&options, "protocol_whitelist", "file", 0);
  int code = avformat_open_input(&context, file.c_str(), nullptr, &options);
  av_dict_free(&options);
  FfmpegPtr<AVFormatContext> owner(context);  // null after an error
  if (code >= 0) code = avformat_find_stream_info(context, nullptr);
  if (code < 0) {
    return BadInput(Concat(file, ": cannot be read as a video (", FfmpegError(code), ")"));
  }
  return owner;
}

Result<VideoContainer> ReadVideoContainer(const std::string& file) {
  auto context = OpenContainer(file);
  if (!context) return tl::unexpected(context.error());
  const int video_index =
      av_find_best_stream(context->get(), AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (video_index < 0) return BadInput(Concat(file, ": has no video stream"));
  const AVStream& video = *(*context)->streams[video_index];

  VideoContainer result;
  result.width_px = video.codecpar->width;
  result.height_px = video.codecpar->height;
  result.display_rotation_deg = DisplayRotationDeg(video);

  // Not nb_frames, which counts what an edit list leaves out, too.
  const int listed = avformat_index_get_entries_count(&video);
  FfmpegPtr<AVPacket> packet(av_packet_alloc());
  int packets = 0;
  bool cut_short = false;
  int64_t last_whole_ns = 0;  // in coding order
  int code = 0;
  while ((code = av_read_frame(context->get(), packet.get())) >= 0) {
    const AVStream& stream = *(*context)->streams[packet->stream_index];
    if (packet->stream_index == video_index) {
      cut_short = cut_short || (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
      if (cut_short) {
        av_packet_unref(packet.get());
        continue;
      }
      ++packets;
      if (packet->pts == AV_NOPTS_VALUE) {
        return BadInput(Concat(file, ": frame ", packets - 1,
                               " of the video has no time stamp; "
                               "give the stamps in cam0/data.csv and a file that has them all"));
      }
      last_whole_ns = av_rescale_q(packet->dts == AV_NOPTS_VALUE ? packet->pts : packet->dts,
                                   stream.time_base, AVRational{1, 1000000000});
      if ((packet->flags & AV_PKT_FLAG_DISCARD) == 0) {  // outside of the edit list: never shown
        result.stamps_ns.push_back(
            av_rescale_q(packet->pts, stream.time_base, AVRational{1, 1000000000}));
      }
    } else if (IsGpmf(stream) && packet->pts != AV_NOPTS_VALUE) {
      result.gpmf.push_back({static_cast<double>(packet->pts) * av_q2d(stream.time_base),
                             {packet->data, packet->data + packet->size}});
    }
    av_packet_unref(packet.get());
  }
  if (code != AVERROR_EOF) {
    return BadInput(
        Concat(file, ": reading stopped after ", packets, " frames (", FfmpegError(code), ")"));
  }
  std::sort(result.stamps_ns.begin(), result.stamps_ns.end());  // packets come in coding order
  if (cut_short || packets < listed) {
    // No frame is shown before it is coded: what is lost comes after the last that is coded whole.
    auto* stamps = &result.stamps_ns;
    stamps->erase(std::upper_bound(stamps->begin(), stamps->end(), last_whole_ns), stamps->end());
    if (stamps->empty()) {
      return BadInput(Concat(file, ": the file is cut short: its index lists ", listed,
                             " frames, none was found whole"));
    }
    result.missing_frames = std::max(1, listed - static_cast<int>(stamps->size()));
  }
  return result;
}

}  // namespace camgyro
