#include "frontend/readers/gpmf.h"

#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr size_t kHeaderSize = 8;

uint64_t BigEndian(const uint8_t* bytes, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) value = value << 8 | bytes[i];
  return value;
}

// Size of one element of a type; 0 for types that are no plain numbers.
size_t ElementSize(char type) {
  switch (type) {
    case 'b':
    case 'B':
      return 1;
    case 's':
    case 'S':
      return 2;
    case 'l':
    case 'L':
    case 'f':
    case 'q':
      return 4;
    case 'j':
    case 'J':
    case 'd':
    case 'Q':
      return 8;
    default:
      return 0;
  }
}

template <typename To, typename From>
double BitCast(From bits) {
  To value;
  static_assert(sizeof(To) == sizeof(From));
  std::memcpy(&value, &bits, sizeof(To));
  return static_cast<double>(value);
}

double Element(char type, const uint8_t* bytes) {
  const uint64_t raw = BigEndian(bytes, ElementSize(type));
  switch (type) {
    case 'b':
      return static_cast<int8_t>(raw);
    case 's':
      return static_cast<int16_t>(raw);
    case 'l':
      return static_cast<int32_t>(raw);
    case 'j':
      return static_cast<double>(static_cast<int64_t>(raw));
    case 'f':
      return BitCast<float>(static_cast<uint32_t>(raw));
    case 'd':
      return BitCast<double>(raw);
    case 'q':  // Q15.16
      return static_cast<int32_t>(raw) / 65536.0;
    case 'Q':  // Q31.32
      return static_cast<double>(static_cast<int64_t>(raw)) / 4294967296.0;
    default:
      return static_cast<double>(raw);
  }
}

// The first of several texts of equal length; one text may be written as many single characters.
std::string FirstWord(const GpmfItem& item) {
  const std::string text = item.Text();
  return item.sample_size > 1 ? std::string(Trim(text.substr(0, item.sample_size))) : text;
}

// The samples of one STRM and what stands before them.
Result<std::optional<GpmfStream>> ReadStream(ByteView bytes) {
  const auto items = ParseGpmf(bytes);
  if (!items) return tl::unexpected(items.error());
  GpmfStream stream;
  std::vector<double> scale;
  for (const GpmfItem& item : *items) {
    if (item.key == "SCAL") scale = item.Numbers();
    if (item.key == "SIUN") stream.unit = FirstWord(item);
    if (item.key == "ORIN") stream.orientation = item.Text();
    const bool counter = item.key == "STMP" || item.key == "TSMP";
    const std::vector<double> numbers = counter ? item.Numbers() : std::vector<double>();
    if (item.key == "STMP" && !numbers.empty()) stream.stamp_us = numbers.front();
    if (item.key == "TSMP" && !numbers.empty()) stream.total_samples = numbers.front();
    if (item.key != "GYRO" && item.key != "ACCL" && item.key != "SHUT" && item.key != "SROT") {
      continue;
    }
    const size_t element_size = ElementSize(item.type);
    stream.key = item.key;
    stream.samples = item.repeat;
    stream.elements = element_size == 0 ? 0 : item.sample_size / element_size;
    stream.values = item.Numbers();
    if (stream.values.size() != stream.samples * stream.elements) {
      return BadInput(Concat(item.key, " has an unexpected type '", item.type, "'"));
    }
    if (!scale.empty() && scale.size() != 1 && scale.size() != stream.elements) {
      return BadInput(
          Concat(item.key, " has ", scale.size(), " scales for ", stream.elements, " elements"));
    }
    for (size_t i = 0; i < stream.values.size(); ++i) {
      if (!scale.empty()) stream.values[i] /= scale[scale.size() == 1 ? 0 : i % stream.elements];
      if (!std::isfinite(stream.values[i])) {
        return BadInput(Concat(item.key, " has a value that is not finite, or a scale of zero"));
      }
    }
  }
  if (stream.key.empty()) return std::optional<GpmfStream>();
  return std::optional<GpmfStream>(std::move(stream));
}

}  // namespace

std::string GpmfItem::Text() const {
  if (type != 'c') return {};
  const auto* begin = reinterpret_cast<const char*>(value.data);
  return std::string(Trim(std::string_view(begin, strnlen(begin, value.size))));
}

std::vector<double> GpmfItem::Numbers() const {
  const size_t size = ElementSize(type);
  if (size == 0 || sample_size % size != 0) return {};
  std::vector<double> numbers(value.size / size);
  for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = Element(type, value.data + i * size);
  return numbers;
}

Result<std::vector<GpmfItem>> ParseGpmf(ByteView bytes) {
  std::vector<GpmfItem> items;
  size_t at = 0;
  while (at + kHeaderSize <= bytes.size) {
    const uint8_t* header = bytes.data + at;
    if (BigEndian(header, 4) == 0) break;  // padding to the end of the level
    GpmfItem item;
    item.key.assign(reinterpret_cast<const char*>(header), 4);
    item.type = static_cast<char>(header[4]);
    item.sample_size = header[5];
    item.repeat = BigEndian(header + 6, 2);
    item.value = {header + kHeaderSize, item.sample_size * item.repeat};
    if (item.value.size > bytes.size - at - kHeaderSize) {
      std::replace_if(
          item.key.begin(), item.key.end(), [](unsigned char c) { return !std::isprint(c); }, '?');
      return BadInput(Concat("item '", item.key, "' needs ", item.value.size, " bytes, only ",
                             bytes.size - at - kHeaderSize, " are left"));
    }
    at += kHeaderSize + (item.value.size + 3) / 4 * 4;
    items.push_back(std::move(item));
  }
  return items;
}

Result<GpmfPayload> ReadGpmfPayload(ByteView bytes) {
  GpmfPayload payload;
  const auto devices = ParseGpmf(bytes);
  if (!devices) return tl::unexpected(devices.error());
  for (const GpmfItem& device : *devices) {
    if (device.key != "DEVC") continue;
    const auto items = ParseGpmf(device.value);
    if (!items) return tl::unexpected(items.error());
    for (const GpmfItem& item : *items) {
      if (item.key == "DVNM" && payload.device_name.empty()) payload.device_name = item.Text();
      if (item.key != "STRM") continue;
      auto stream = ReadStream(item.value);
      if (!stream) return tl::unexpected(stream.error());
      if (!*stream) continue;
      const bool known = std::any_of(payload.streams.begin(), payload.streams.end(),
                                     [&](const auto& s) { return s.key == (*stream)->key; });
      if (!known) payload.streams.push_back(std::move(**stream));
    }
  }
  return payload;
}

std::optional<Eigen::Matrix3d> AxesFromOrientation(const std::string& orientation) {
  if (orientation.size() != 3) return std::nullopt;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const auto letter = static_cast<unsigned char>(orientation[i]);
    const int axis = std::tolower(letter) - 'x';
    if (axis < 0 || axis > 2) return std::nullopt;
    axes(axis, i) = std::isupper(letter) ? 1.0 : -1.0;
  }
  // -1: mirrored; 0: an axis twice.
  if (axes.determinant() < 0.5) return std::nullopt;
  return axes;
}

}  // namespace camgyro
