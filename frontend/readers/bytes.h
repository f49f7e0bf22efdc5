// Bytes that someone else owns, and a cursor that cannot leave them.
#ifndef CAMGYRO_FRONTEND_READERS_BYTES_H_
#define CAMGYRO_FRONTEND_READERS_BYTES_H_

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

namespace camgyro {

struct ByteView {
  const uint8_t* data = nullptr;
  size_t size = 0;
};

// The most bytes that a reader holds of one record of a file. The largest pictures of cameras, 100
// megapixels of three bytes, stay below it.
constexpr uint64_t kLargestRecord = 512u << 20;

// Takes values from the front of a view. After a read beyond its end good() is false, and all that
// is read is zero or empty.
class ByteCursor {
 public:
  explicit ByteCursor(ByteView bytes, bool big_endian = false)
      : bytes_(bytes), big_endian_(big_endian) {}

  bool good() const { return good_; }
  size_t position() const { return at_; }
  size_t left() const { return bytes_.size - at_; }

  ByteView Take(uint64_t size) {
    if (!good_ || size > left()) {
      good_ = false;
      return {};
    }
    const ByteView taken{bytes_.data + at_, static_cast<size_t>(size)};
    at_ += taken.size;
    return taken;
  }
  void Skip(uint64_t size) { Take(size); }

  uint8_t U8() { return static_cast<uint8_t>(Whole(1)); }
  uint16_t U16() { return static_cast<uint16_t>(Whole(2)); }
  uint32_t U32() { return static_cast<uint32_t>(Whole(4)); }
  uint64_t U64() { return Whole(8); }
  double F64() {
    const uint64_t bits = Whole(8);
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  // A string of `size` bytes.
  std::string Text(uint64_t size) {
    const ByteView text = Take(size);
    return std::string(reinterpret_cast<const char*>(text.data), text.size);
  }

 private:
  uint64_t Whole(size_t size) {
    const ByteView taken = Take(size);
    uint64_t value = 0;
    for (size_t i = 0; i < taken.size; ++i) {
      value = value << 8 | taken.data[big_endian_ ? i : taken.size - 1 - i];
    }
    return value;
  }

  const ByteView bytes_;
  const bool big_endian_;
  size_t at_ = 0;
  bool good_ = true;
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_BYTES_H_
