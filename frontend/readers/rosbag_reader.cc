#include "frontend/readers/rosbag_reader.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/readers/text.h"

namespace camgyro {
namespace {

int64_t StampNs(const std_msgs::Header& header) {
  return int64_t{1000000000} * header.stamp.sec + int64_t{header.stamp.nsec};
}

ByteView View(const std::vector<uint8_t>& bytes) { return {bytes.data(), bytes.size()}; }

class Rosbag : public Bag {
 public:
  explicit Rosbag(const std::string& path) : path_(path) {}

  Status Open() {
    return Guard<void>([this]() -> Status {
      bag_.open(path_, rosbag::bagmode::Read);
      rosbag::View view(bag_);
      for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
        if (!index_.emplace(connection->topic, topics_.size()).second) continue;
        topics_.push_back(
            {connection->topic, connection->datatype, BagTypeOf(connection->datatype)});
      }
      return {};
    });
  }

  Status Select(const std::vector<bool>& wanted) override {
    return Guard<void>([&]() -> Status {
      std::vector<std::string> names;
      for (size_t i = 0; i < topics_.size(); ++i) {
        if (wanted[i]) names.push_back(topics_[i].name);
      }
      view_.emplace(bag_, rosbag::TopicQuery(names));
      message_ = view_->begin();
      counts_.assign(topics_.size(), 0);
      return {};
    });
  }

  Result<bool> Next(BagMessage* message) override {
    return Guard<bool>([&]() -> Result<bool> {
      for (; message_ != view_->end(); ++message_) {
        message->topic = index_.at(message_->getTopic());
        ++counts_[message->topic];
        const BagTopic& topic = topics_[message->topic];
        if (topic.type == BagType::kOther) continue;
        if (!Decode(topic.type, message)) {
          return BadInput(Concat(path_, ": ", topic.name, ", message ", counts_[message->topic],
                                 ": is no ", topic.type_name));
        }
        ++message_;
        return true;
      }
      return false;
    });
  }

 private:
  // Calls `read`, whose exceptions are librosbag's, and boost's on damaged files.
  template <typename T>
  tl::expected<T, Error> Guard(const std::function<tl::expected<T, Error>()>& read) {
    try {
      return read();
    } catch (const rosbag::BagUnindexedException&) {
      return BadInput(Concat(path_,
                             ": the bag has no index: its recording was cut short; expected a "
                             "closed bag (`rosbag reindex` repairs it)"));
    } catch (const std::exception& error) {
      return BadInput(Concat(path_, ": cannot be read as a ROS bag (", error.what(), ")"));
    }
  }

  bool Decode(BagType type, BagMessage* message) {
    if (type == BagType::kImu) {
      const auto imu = message_->instantiate<sensor_msgs::Imu>();
      if (!imu) return false;
      const auto &w = imu->angular_velocity, &a = imu->linear_acceleration;
      message->stamp_ns = StampNs(imu->header);
      message->content = BagImu{{w.x, w.y, w.z}, {a.x, a.y, a.z}};
    } else if (type == BagType::kImage) {
      image_ = message_->instantiate<sensor_msgs::Image>();
      if (!image_) return false;
      message->stamp_ns = StampNs(image_->header);
      message->content =
          RosImage{image_->height, image_->width,     image_->encoding, image_->is_bigendian != 0,
                   image_->step,   View(image_->data)};
    } else if (type == BagType::kCompressedImage) {
      compressed_ = message_->instantiate<sensor_msgs::CompressedImage>();
      if (!compressed_) return false;
      message->stamp_ns = StampNs(compressed_->header);
      message->content = BagCompressedImage{View(compressed_->data)};
    } else {
      const auto info = message_->instantiate<sensor_msgs::CameraInfo>();
      if (!info) return false;
      message->stamp_ns = StampNs(info->header);
      message->content = BagCameraInfo{info->height,
                                       info->width,
                                       info->distortion_model,
                                       info->D,
                                       {info->K[0], info->K[4], info->K[2], info->K[5]},
                                       {info->P[0], info->P[5], info->P[2], info->P[6]}};
    }
    return true;
  }

  const std::string path_;
  rosbag::Bag bag_;
  std::map<std::string, size_t> index_;  // of names into topics_
  std::vector<size_t> counts_;           // of messages taken, of each topic
  std::optional<rosbag::View> view_;
  rosbag::View::iterator message_;
  // The owners of what the last message's views point to.
  sensor_msgs::ImageConstPtr image_;
  sensor_msgs::CompressedImageConstPtr compressed_;
};

}  // namespace

Result<std::unique_ptr<Bag>> OpenRosbag(const std::string& path) {
  auto bag = std::make_unique<Rosbag>(path);
  if (Status open = bag->Open(); !open) return tl::unexpected(open.error());
  return bag;
}

}  // namespace camgyro
