// sensor_msgs/Image of ROS 1 and ROS 2 as grey values.
#ifndef CAMGYRO_FRONTEND_READERS_ROS_IMAGE_H_
#define CAMGYRO_FRONTEND_READERS_ROS_IMAGE_H_

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

#include "core/result.h"
#include "frontend/readers/bytes.h"

namespace camgyro {

struct RosImage {
  uint32_t height = 0, width = 0;
  std::string encoding;
  bool is_bigendian = false;
  uint32_t step = 0;  // bytes from row to row
  ByteView data;
};

// 8-bit grey of a picture in mono8, mono16, rgb8, bgr8, rgba8, bgra8, bayer_*8, yuv422 (= uyvy) or
// yuv422_yuy2 (= yuyv) (github.com/ros2/common_interfaces, image_encodings.hpp). Errors: another
// encoding, fewer bytes than the size needs, more than 2^28 pixels.
Result<cv::Mat> GrayFromRosImage(const RosImage& image);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_ROS_IMAGE_H_
