#include "frontend/readers/mp4_box.h"

#include <fstream>

namespace camgyro {
namespace {

constexpr uint64_t kLargestContent = 64u << 20;  // of a box that is read into memory

uint64_t ReadBigEndian(std::ifstream* in, int bytes) {
  uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | (static_cast<uint64_t>(in->get()) & 0xFF);
  return value;
}

}  // namespace

std::optional<std::vector<uint8_t>> ReadMp4Box(const std::string& file,
                                               const std::vector<std::string>& path) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) return std::nullopt;
  uint64_t begin = 0, end = static_cast<uint64_t>(in.tellg());  // of the level
  for (const std::string& wanted : path) {
    for (;;) {
      if (begin + 8 > end) return std::nullopt;
      in.seekg(static_cast<std::streamoff>(begin));
      uint64_t size = ReadBigEndian(&in, 4);
      std::string name(4, '\0');
      in.read(name.data(), 4);
      uint64_t header = 8;
      if (size == 1) {  // the real size follows
        size = ReadBigEndian(&in, 8);
        header = 16;
      } else if (size == 0) {  // up to the end
        size = end - begin;
      }
      if (!in || size < header || size > end - begin) return std::nullopt;
      if (name == wanted) {
        end = begin + size;
        begin += header;
        break;
      }
      begin += size;
    }
  }
  if (end - begin > kLargestContent) return std::nullopt;
  std::vector<uint8_t> content(end - begin);
  in.seekg(static_cast<std::streamoff>(begin));
  in.read(reinterpret_cast<char*>(content.data()), static_cast<std::streamsize>(content.size()));
  if (!in) return std::nullopt;
  return content;
}

}  // namespace camgyro
