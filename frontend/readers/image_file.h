// One image of a recording.
#ifndef CAMGYRO_FRONTEND_READERS_IMAGE_FILE_H_
#define CAMGYRO_FRONTEND_READERS_IMAGE_FILE_H_

#include <opencv2/core/mat.hpp>
#include <string>

#include "core/result.h"
#include "frontend/readers/bytes.h"

namespace camgyro {

// Decodes an image as 8-bit grey, as stored (an EXIF rotation is not applied: rows are time).
// An image that cannot be decoded, or is cut short, is an error. OpenCV alone fills up the missing
// part of a half-written JPEG with grey and reports success.
Result<cv::Mat> ReadGrayImage(const std::string& file);
// The same of an image that is in memory.
Result<cv::Mat> DecodeGrayImage(ByteView bytes);
// The same with three channels, blue first; grey images have three equal ones.
Result<cv::Mat> ReadColourImage(const std::string& file);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_IMAGE_FILE_H_
