// What ROS 1 and ROS 2 bags have in common: topics with messages of sensor_msgs, and how a
// recording is made of them, whatever the container.
#ifndef CAMGYRO_FRONTEND_READERS_BAG_H_
#define CAMGYRO_FRONTEND_READERS_BAG_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/frame_source.h"
#include "frontend/readers/bytes.h"
#include "frontend/readers/ros_image.h"

namespace camgyro {

enum class BagType { kImu, kImage, kCompressedImage, kCameraInfo, kOther };

// The type of a name such as "sensor_msgs/Imu" (ROS 1) or "sensor_msgs/msg/Imu" (ROS 2).
BagType BagTypeOf(const std::string& name);

struct BagTopic {
  std::string name;
  std::string type_name;  // as the bag has it, for messages
  BagType type = BagType::kOther;
};

struct BagImu {
  Eigen::Vector3d rates_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();
};

struct BagCompressedImage {
  ByteView data;  // of a JPEG, PNG, ...
};

struct BagCameraInfo {
  uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> distortion;
  // fx, fy, cx, cy of the raw and of the rectified picture (K and P).
  Eigen::Vector4d raw = Eigen::Vector4d::Zero();
  Eigen::Vector4d rectified = Eigen::Vector4d::Zero();
};

// A message as far as camgyro reads it. Views are valid until the next message is taken.
struct BagMessage {
  size_t topic = 0;      // index into Bag::topics()
  int64_t stamp_ns = 0;  // of its header
  std::variant<BagImu, RosImage, BagCompressedImage, BagCameraInfo> content;
};

// An open bag.
class Bag {
 public:
  virtual ~Bag() = default;

  const std::vector<BagTopic>& topics() const { return topics_; }
  // What was odd about the file, and is no reason to refuse it. Complete after the last message.
  const std::vector<std::string>& notes() const { return notes_; }

  // Begins anew, with the messages of those topics: one flag for each of topics().
  virtual Status Select(const std::vector<bool>& wanted) = 0;

  // The next message of a known type in the order of the file; false at its end. A message that
  // cannot be decoded is an error that names topic and number.
  virtual Result<bool> Next(BagMessage* message) = 0;

 protected:
  std::vector<BagTopic> topics_;
  std::vector<std::string> notes_;
};

// Opens a container of bags; formats.h has them.
using OpenBag = Result<std::unique_ptr<Bag>> (*)(const std::string& path);

// Which topics to take; empty: to be found.
struct BagTopics {
  std::string imu, image;
};

// A recording of a bag: gyro and accelerometer of one sensor_msgs/Imu topic, frames of one Image or
// CompressedImage topic, intrinsics of the CameraInfo beside it as an initial guess. Of several IMU
// topics the first by name whose rates are not all zero (drivers publish accelerations as messages
// of their own); of several image topics the first by name that is not called depth. What was
// chosen of several is noted. The pictures stay in the bag: Recording::video_file is `path`.
Result<Recording> ReadBag(const std::string& path, OpenBag open, const BagTopics& wanted = {});

// The pictures of such a recording, which must outlive the source. `path`, `open` and `wanted` are
// those of ReadBag.
Result<std::unique_ptr<FrameSource>> OpenBagFrames(const Recording& recording,
                                                   const std::string& path, OpenBag open,
                                                   const BagTopics& wanted = {});

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_BAG_H_
