#include "frontend/readers/ros_image.h"

#include <map>
#include <opencv2/imgproc.hpp>

#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr uint64_t kMostPixels = uint64_t{1} << 28;

struct Encoding {
  int type;
  int to_gray;  // cv::ColorConversionCodes; -1: it is grey
};

const Encoding* FindEncoding(const std::string& name) {
  static const std::map<std::string, Encoding> encodings = {
      {"mono8", {CV_8UC1, -1}},
      {"8UC1", {CV_8UC1, -1}},
      {"mono16", {CV_16UC1, -1}},
      {"16UC1", {CV_16UC1, -1}},
      {"rgb8", {CV_8UC3, cv::COLOR_RGB2GRAY}},
      {"bgr8", {CV_8UC3, cv::COLOR_BGR2GRAY}},
      {"rgba8", {CV_8UC4, cv::COLOR_RGBA2GRAY}},
      {"bgra8", {CV_8UC4, cv::COLOR_BGRA2GRAY}},
      {"yuv422", {CV_8UC2, cv::COLOR_YUV2GRAY_UYVY}},
      {"uyvy", {CV_8UC2, cv::COLOR_YUV2GRAY_UYVY}},
      {"yuv422_yuy2", {CV_8UC2, cv::COLOR_YUV2GRAY_YUY2}},
      {"yuyv", {CV_8UC2, cv::COLOR_YUV2GRAY_YUY2}},
      // OpenCV names a Bayer pattern by its second row's second and third pixel.
      {"bayer_rggb8", {CV_8UC1, cv::COLOR_BayerBG2GRAY}},
      {"bayer_bggr8", {CV_8UC1, cv::COLOR_BayerRG2GRAY}},
      {"bayer_gbrg8", {CV_8UC1, cv::COLOR_BayerGR2GRAY}},
      {"bayer_grbg8", {CV_8UC1, cv::COLOR_BayerGB2GRAY}}};
  const auto found = encodings.find(name);
  return found == encodings.end() ? nullptr : &found->second;
}

}  // namespace

Result<cv::Mat> GrayFromRosImage(const RosImage& image) {
  const Encoding* encoding = FindEncoding(image.encoding);
  if (encoding == nullptr) {
    return BadInput(Concat("encoding '", image.encoding, "' is not supported"));
  }
  const uint64_t width = image.width, height = image.height, step = image.step;
  const uint64_t row = width * static_cast<uint64_t>(CV_ELEM_SIZE(encoding->type));
  if (width * height > kMostPixels) {
    return BadInput(Concat("has ", width, " x ", height, " pixels, more than any camera"));
  }
  if (height == 0 || row == 0 || step < row || image.data.size < step * (height - 1) + row) {
    return BadInput("the picture's data are cut short");
  }
  if (image.is_bigendian && CV_ELEM_SIZE1(encoding->type) > 1) {
    return BadInput("big-endian pixels are not supported");
  }
  cv::Mat gray;
  try {
    const cv::Mat raw(static_cast<int>(height), static_cast<int>(width), encoding->type,
                      const_cast<uint8_t*>(image.data.data), step);
    if (encoding->to_gray >= 0) {
      cv::cvtColor(raw, gray, encoding->to_gray);
    } else {
      raw.convertTo(gray, CV_8U, raw.depth() == CV_16U ? 1.0 / 256.0 : 1.0);
    }
  } catch (const cv::Exception&) {  // of sizes that a pattern does not allow
    return BadInput(Concat("a picture of ", width, " x ", height,
                           " pixels cannot have the encoding '", image.encoding, "'"));
  }
  return gray;
}

}  // namespace camgyro
