// VideoIMUCapture's protobuf for tests, written byte by byte as its recording.proto numbers the
// fields.
#ifndef CAMGYRO_TESTS_FRONTEND_READERS_VIDEO_META_BYTES_H_
#define CAMGYRO_TESTS_FRONTEND_READERS_VIDEO_META_BYTES_H_

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace camgyro::video_meta {

inline std::string Varint(uint64_t value) {
  std::string bytes;
  for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(0x80 | (value & 0x7f));
  return bytes + static_cast<char>(value);
}
inline std::string Whole(int field, uint64_t value) {
  return Varint(static_cast<uint64_t>(field) << 3) + Varint(value);
}
inline std::string Bytes(int field, const std::string& bytes) {
  return Varint(static_cast<uint64_t>(field) << 3 | 2) + Varint(bytes.size()) + bytes;
}
inline std::string Floats(int field, const std::vector<float>& values) {
  std::string bytes(values.size() * sizeof(float), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return Bytes(field, bytes);
}
inline std::string Float(int field, float value) {
  std::string bytes(sizeof(float), '\0');
  std::memcpy(bytes.data(), &value, sizeof(float));
  return Varint(static_cast<uint64_t>(field) << 3 | 5) + bytes;
}

inline std::string Imu(uint64_t time_ns, const std::vector<float>& gyro) {
  return Bytes(4, Whole(1, time_ns) + Floats(2, gyro) + Floats(3, {9, 9, 9}) +
                      Floats(4, {0, 0.5f, 9.75f}) + Whole(6, 3));
}
// more: further fields.
inline std::string Picture(uint64_t time_ns, uint64_t number, const std::string& more = "") {
  return Bytes(5, Whole(1, time_ns) + Whole(2, number) + Whole(3, 5000000) + Whole(5, 20000000) +
                      Float(8, 512.5f) + more);
}
inline std::string LensPosition(uint64_t time_ns, float x, float y) {
  return Bytes(10, Whole(1, time_ns) + Float(2, x) + Float(3, y));
}

}  // namespace camgyro::video_meta

#endif  // CAMGYRO_TESTS_FRONTEND_READERS_VIDEO_META_BYTES_H_
