// What a video file holds besides its pictures: frame stamps, size, telemetry packets.
#ifndef CAMGYRO_FRONTEND_READERS_VIDEO_CONTAINER_H_
#define CAMGYRO_FRONTEND_READERS_VIDEO_CONTAINER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"
#include "frontend/readers/ffmpeg.h"

namespace camgyro {

struct DataPacket {
  double start_s = 0.0;  // from the container's time 0
  std::vector<uint8_t> bytes;
};

struct VideoContainer {
  int width_px = 0, height_px = 0;  // as coded; a rotation for display is not applied
  int display_rotation_deg = 0;     // of the display matrix, clockwise; 0 without one
  std::vector<int64_t> stamps_ns;   // of the shown frames, from the container's time 0, increasing
  // Of a file that is cut short: frames at its end that are listed but not whole, or that frames
  // which are not whole may come before. They are not in stamps_ns.
  int missing_frames = 0;
  std::vector<DataPacket> gpmf;  // packets of a GoPro telemetry stream, in order
};

// Reads all packets of a file, without decoding any. Errors: not a video (also one that is cut
// short where its index stands at the end), no video stream, not one whole frame, frames without or
// with repeated stamps.
Result<VideoContainer> ReadVideoContainer(const std::string& file);

// Opens a file of a container that holds its pictures itself (MP4 and QuickTime, Matroska, AVI,
// MPEG-TS, MXF) and finds its streams; playlists are refused. Lowers FFmpeg's log level to fatal,
// for the whole process: errors are values here, and GoPro files have streams that it would print
// warnings about. Lowers the most that FFmpeg allocates at once to kLargestRecord, also for the
// whole process.
Result<FfmpegPtr<AVFormatContext>> OpenContainer(const std::string& file);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_VIDEO_CONTAINER_H_
