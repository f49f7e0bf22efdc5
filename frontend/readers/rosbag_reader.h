// ROS 1 bags (format 2.0), through librosbag. Of builds that have it: see formats.cc.
#ifndef CAMGYRO_FRONTEND_READERS_ROSBAG_READER_H_
#define CAMGYRO_FRONTEND_READERS_ROSBAG_READER_H_

#include <memory>
#include <string>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/frame_source.h"

namespace camgyro {

// Gyro and accelerometer of the sensor_msgs/Imu topic, frames of the sensor_msgs/Image or
// CompressedImage topic; of several the first by name, noted. Stamps are those of the headers. The
// pictures stay in the bag (Recording::video_file) until OpenRosbagFrames. Errors: not a bag, or
// one that was not closed; no such topic; stamps that do not increase.
Result<Recording> ReadRosbag(const std::string& path);

// The pictures of a recording from ReadRosbag, which must outlive the source. Encodings: mono8,
// rgb8, bgr8, rgba8, bgra8, bayer_*8, mono16, and what OpenCV decodes of compressed ones.
Result<std::unique_ptr<FrameSource>> OpenRosbagFrames(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_ROSBAG_READER_H_
