// Composes GPMF items for tests.
#ifndef CAMGYRO_TESTS_FRONTEND_READERS_GPMF_BYTES_H_
#define CAMGYRO_TESTS_FRONTEND_READERS_GPMF_BYTES_H_

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

namespace camgyro {

inline std::string BigEndianBytes(uint64_t value, int size) {
  std::string bytes;
  for (int i = size - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
  return bytes;
}

// An item: header, content, padding to 32 bits. size * repeat is the length of the content.
inline std::string GpmfItemBytes(const std::string& key, char type, int size, int repeat,
                                 const std::string& content) {
  std::string bytes = key + type + BigEndianBytes(size, 1) + BigEndianBytes(repeat, 2) + content;
  while (bytes.size() % 4 != 0) bytes += '\0';
  return bytes;
}

inline std::string GpmfNested(const std::string& key, const std::string& content) {
  return GpmfItemBytes(key, '\0', 1, static_cast<int>(content.size()), content);
}

inline std::string GpmfText(const std::string& key, const std::string& text) {
  return GpmfItemBytes(key, 'c', 1, static_cast<int>(text.size()), text);
}

inline std::string GpmfLong(const std::string& key, uint32_t value) {
  return GpmfItemBytes(key, 'L', 4, 1, BigEndianBytes(value, 4));
}

inline std::string GpmfFloats(const std::string& key, const std::vector<float>& values) {
  std::string content;
  for (const float value : values) {
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    content += BigEndianBytes(bits, 4);
  }
  return GpmfItemBytes(key, 'f', 4, static_cast<int>(values.size()), content);
}

// Samples of three int16 elements, as GYRO and ACCL.
inline std::string GpmfTriples(const std::string& key, const std::vector<int16_t>& values) {
  std::string content;
  for (const int16_t value : values) content += BigEndianBytes(static_cast<uint16_t>(value), 2);
  return GpmfItemBytes(key, 's', 6, static_cast<int>(values.size() / 3), content);
}

inline std::string GpmfShort(const std::string& key, int16_t value) {
  return GpmfItemBytes(key, 's', 2, 1, BigEndianBytes(static_cast<uint16_t>(value), 2));
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_READERS_GPMF_BYTES_H_
