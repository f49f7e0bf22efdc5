#include "frontend/readers/image_file.h"

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "frontend/readers/text.h"
#include "frontend/readers/whole_file.h"

namespace camgyro {
namespace {

bool IsJpeg(ByteView bytes) {
  return bytes.size > 2 && bytes.data[0] == 0xFF && bytes.data[1] == 0xD8;
}

// Walks the segments of a JPEG (ITU T.81, annex B) up to its end marker; thumbnails, which have
// an end marker of their own, are inside of segments that are skipped.
bool JpegIsWhole(ByteView bytes) {
  size_t at = 2;
  while (at + 1 < bytes.size) {
    const uint8_t marker = bytes.data[at + 1];
    // Not a marker, a stuffed 0xFF of coded data, a fill byte, a restart.
    if (bytes.data[at] != 0xFF || marker == 0x00 || marker == 0xFF ||
        (marker >= 0xD0 && marker <= 0xD7)) {
      ++at;
    } else if (marker == 0xD9) {
      return true;
    } else if (at + 3 < bytes.size) {
      at += 2u + 256u * bytes.data[at + 2] + bytes.data[at + 3];
    } else {
      return false;
    }
  }
  return false;
}

Result<cv::Mat> DecodeImage(ByteView bytes, int flags) {
  if (bytes.size == 0 || bytes.size > kLargestRecord) return BadInput("expected an image");
  if (IsJpeg(bytes) && !JpegIsWhole(bytes)) {
    return BadInput("the JPEG is cut short, expected a whole image");
  }
  try {
    const cv::Mat encoded(1, static_cast<int>(bytes.size), CV_8UC1,
                          const_cast<uint8_t*>(bytes.data));
    cv::Mat image = cv::imdecode(encoded, flags | cv::IMREAD_IGNORE_ORIENTATION);
    if (!image.empty()) return image;
  } catch (const cv::Exception&) {
    // Answered like an empty picture; OpenCV's text names its own source lines.
  }
  return BadInput("cannot be decoded, expected a whole image");
}

Result<cv::Mat> ReadImage(const std::string& file, int flags) {
  const Result<std::string> bytes = ReadWholeFile(file);
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->empty()) return BadInput(Concat(file, ": is empty, expected an image"));
  Result<cv::Mat> image =
      DecodeImage({reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size()}, flags);
  if (!image) return BadInput(Concat(file, ": ", image.error().message));
  return image;
}

}  // namespace

Result<cv::Mat> DecodeGrayImage(ByteView bytes) { return DecodeImage(bytes, cv::IMREAD_GRAYSCALE); }

Result<cv::Mat> ReadGrayImage(const std::string& file) {
  return ReadImage(file, cv::IMREAD_GRAYSCALE);
}

Result<cv::Mat> ReadColourImage(const std::string& file) {
  return ReadImage(file, cv::IMREAD_COLOR);
}

}  // namespace camgyro
