// Boxes of an MP4 file that libavformat does not hand out.
#ifndef CAMGYRO_FRONTEND_READERS_MP4_BOX_H_
#define CAMGYRO_FRONTEND_READERS_MP4_BOX_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace camgyro {

// The content of the first box at a path of names, e.g. {"moov", "udta", "GPMF"} (ISO 14496-12,
// 4.2). Nothing if there is no such box, or the file cannot be read.
std::optional<std::vector<uint8_t>> ReadMp4Box(const std::string& file,
                                               const std::vector<std::string>& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_MP4_BOX_H_
