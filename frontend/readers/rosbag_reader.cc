#include "frontend/readers/rosbag_reader.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include <algorithm>
#include <functional>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr char kImu[] = "sensor_msgs/Imu";
constexpr char kImage[] = "sensor_msgs/Image";
constexpr char kCompressed[] = "sensor_msgs/CompressedImage";

// Calls `read`, whose exceptions are librosbag's and OpenCV's, and boost's on damaged files.
template <typename T>
Result<T> Guard(const std::string& path, const std::function<Result<T>()>& read) {
  try {
    return read();
  } catch (const rosbag::BagUnindexedException&) {
    return BadInput(Concat(path,
                           ": the bag has no index: its recording was cut short; expected a closed "
                           "bag (`rosbag reindex` repairs it)"));
  } catch (const std::exception& error) {
    return BadInput(Concat(path, ": cannot be read as a ROS bag (", error.what(), ")"));
  }
}

std::string FirstTopic(const std::map<std::string, std::string>& types,
                       const std::vector<std::string>& wanted, std::vector<std::string>* all) {
  for (const auto& [topic, type] : types) {
    if (std::count(wanted.begin(), wanted.end(), type) > 0) all->push_back(topic);
  }
  return all->empty() ? "" : all->front();
}

struct Topics {
  std::string imu, image;
};

Result<Topics> FindTopics(const std::string& path, const rosbag::Bag& bag,
                          std::vector<std::string>* notes) {
  rosbag::View view(bag);
  std::map<std::string, std::string> types;
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    types[connection->topic] = connection->datatype;
  }
  Topics topics;
  const auto pick = [&](const std::vector<std::string>& wanted, std::string* topic) -> Status {
    std::vector<std::string> all;
    *topic = FirstTopic(types, wanted, &all);
    if (topic->empty()) {
      std::string found;
      for (const auto& [name, type] : types) {
        found += (found.empty() ? "" : ", ") + name + " (" + type + ")";
      }
      return BadInput(Concat(path, ": has no topic of ", wanted.front(), "; it has ",
                             found.empty() ? "none" : found));
    }
    if (all.size() > 1 && notes != nullptr) {
      notes->push_back(Concat(path, ": has ", all.size(), " topics of ", wanted.front(),
                              "; took the first, ", *topic));
    }
    return {};
  };
  Status status = pick({kImu}, &topics.imu);
  if (status) status = pick({kImage, kCompressed}, &topics.image);
  if (!status) return tl::unexpected(status.error());
  return topics;
}

int64_t StampNs(const ros::Time& stamp) {
  return int64_t{1000000000} * stamp.sec + int64_t{stamp.nsec};
}

// Grey values of a raw image, or why not.
Result<cv::Mat> ToGray(const sensor_msgs::Image& image) {
  struct Encoding {
    int type;
    int to_gray;  // cv::ColorConversionCodes; -1: it is grey
  };
  static const std::map<std::string, Encoding> encodings = {
      {"mono8", {CV_8UC1, -1}},
      {"8UC1", {CV_8UC1, -1}},
      {"mono16", {CV_16UC1, -1}},
      {"16UC1", {CV_16UC1, -1}},
      {"rgb8", {CV_8UC3, cv::COLOR_RGB2GRAY}},
      {"bgr8", {CV_8UC3, cv::COLOR_BGR2GRAY}},
      {"rgba8", {CV_8UC4, cv::COLOR_RGBA2GRAY}},
      {"bgra8", {CV_8UC4, cv::COLOR_BGRA2GRAY}},
      // OpenCV names a Bayer pattern by its second row's second and third pixel.
      {"bayer_rggb8", {CV_8UC1, cv::COLOR_BayerBG2GRAY}},
      {"bayer_bggr8", {CV_8UC1, cv::COLOR_BayerRG2GRAY}},
      {"bayer_gbrg8", {CV_8UC1, cv::COLOR_BayerGR2GRAY}},
      {"bayer_grbg8", {CV_8UC1, cv::COLOR_BayerGB2GRAY}}};
  const auto found = encodings.find(image.encoding);
  if (found == encodings.end()) {
    return BadInput(Concat("encoding '", image.encoding, "' is not supported"));
  }
  const size_t row = image.width * CV_ELEM_SIZE(found->second.type);
  if (image.height == 0 || row == 0 || image.step < row ||
      image.data.size() < image.step * (image.height - 1) + row) {
    return BadInput("the picture's data are cut short");
  }
  if (image.is_bigendian != 0 && CV_ELEM_SIZE1(found->second.type) > 1) {
    return BadInput("big-endian pixels are not supported");
  }
  const cv::Mat raw(static_cast<int>(image.height), static_cast<int>(image.width),
                    found->second.type, const_cast<uint8_t*>(image.data.data()), image.step);
  cv::Mat gray;
  if (found->second.to_gray >= 0) {
    cv::cvtColor(raw, gray, found->second.to_gray);
  } else {
    raw.convertTo(gray, CV_8U, raw.depth() == CV_16U ? 1.0 / 256.0 : 1.0);
  }
  return gray;
}

Result<cv::Mat> ToGray(const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) return ToGray(*image);
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  if (!compressed) return BadInput("is no image");
  cv::Mat gray =
      cv::imdecode(compressed->data, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (gray.empty()) return BadInput("cannot be decoded, expected a whole image");
  return gray;
}

int64_t ImageStampNs(const rosbag::MessageInstance& message) {
  if (message.getDataType() == kImage) {
    return StampNs(message.instantiate<sensor_msgs::Image>()->header.stamp);
  }
  return StampNs(message.instantiate<sensor_msgs::CompressedImage>()->header.stamp);
}

// Where a message stands, for complaints.
std::string Place(const std::string& path, const std::string& topic, size_t index) {
  return Concat(path, ": ", topic, ", message ", index + 1, ": ");
}

Status ReadImu(const std::string& path, const rosbag::Bag& bag, const std::string& topic,
               Recording* recording) {
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  GyroCollector gyro(recording);
  size_t index = 0;
  for (const rosbag::MessageInstance& message : view) {
    const auto imu = message.instantiate<sensor_msgs::Imu>();
    const auto& w = imu->angular_velocity;
    const auto& a = imu->linear_acceleration;
    const Eigen::Vector3d rates(w.x, w.y, w.z), accel(a.x, a.y, a.z);
    if (!rates.allFinite() || !accel.allFinite()) {
      return BadInput(Place(path, topic, index) +
                      "angular_velocity or linear_acceleration is not "
                      "finite");
    }
    gyro.Add({StampNs(imu->header.stamp), rates}, accel,
             [&] { return Concat(path, ": ", topic, ", message ", index + 1); });
    ++index;
  }
  return gyro.Finish(path + ": " + topic);
}

Status ReadFrames(const std::string& path, const rosbag::Bag& bag, const std::string& topic,
                  Recording* recording) {
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& message : view) {
    std::vector<Frame>& frames = recording->frames;
    Frame frame;
    frame.stamp_ns = ImageStampNs(message);
    if (frames.empty()) {
      const Result<cv::Mat> first = ToGray(message);
      if (!first) return BadInput(Place(path, topic, 0) + first.error().message);
      recording->camera.width_px = first->cols;
      recording->camera.height_px = first->rows;
    } else if (const auto wrong = NotIncreasing(frames.back().stamp_ns, frame.stamp_ns)) {
      return BadInput(Place(path, topic, frames.size()) + *wrong);
    }
    frames.push_back(frame);
  }
  recording->video_file = path;
  return CheckFrames(path + ": " + topic, recording->frames);
}

class RosbagFrames : public FrameSource {
 public:
  explicit RosbagFrames(const Recording& recording) : recording_(recording) {}

  Result<bool> Open() {
    return Guard<bool>(File(), [this]() -> Result<bool> {
      bag_.open(File(), rosbag::bagmode::Read);
      const Result<Topics> topics = FindTopics(File(), bag_, nullptr);
      if (!topics) return tl::unexpected(topics.error());
      topic_ = topics->image;
      view_.emplace(bag_, rosbag::TopicQuery(topic_));
      message_ = view_->begin();
      return true;
    });
  }

  Result<bool> Next(cv::Mat* gray) override {
    if (next_ == recording_.frames.size()) return false;
    return Guard<bool>(File(), [&]() -> Result<bool> {
      if (message_ == view_->end()) {
        return BadInput(Concat(File(), ": ", topic_, " ends after picture ", next_));
      }
      Result<cv::Mat> image = ToGray(*message_);
      if (!image) return BadInput(Place(File(), topic_, next_) + image.error().message);
      if (image->cols != recording_.camera.width_px || image->rows != recording_.camera.height_px) {
        return BadInput(Concat(Place(File(), topic_, next_), "has ", image->cols, " x ",
                               image->rows, " pixels, expected those of the first"));
      }
      *gray = std::move(*image);
      ++message_;
      ++next_;
      return true;
    });
  }

 private:
  const std::string& File() const { return recording_.video_file; }

  const Recording& recording_;
  rosbag::Bag bag_;
  std::string topic_;
  std::optional<rosbag::View> view_;
  rosbag::View::iterator message_;
  size_t next_ = 0;
};

}  // namespace

Result<Recording> ReadRosbag(const std::string& path) {
  return Guard<Recording>(path, [&]() -> Result<Recording> {
    rosbag::Bag bag;
    bag.open(path, rosbag::bagmode::Read);
    Recording recording;
    recording.path = path;
    const Result<Topics> topics = FindTopics(path, bag, &recording.notes);
    if (!topics) return tl::unexpected(topics.error());
    Status status = ReadImu(path, bag, topics->imu, &recording);
    if (status) status = ReadFrames(path, bag, topics->image, &recording);
    if (!status) return tl::unexpected(status.error());
    NoteClocks(&recording);
    return recording;
  });
}

Result<std::unique_ptr<FrameSource>> OpenRosbagFrames(const Recording& recording) {
  auto frames = std::make_unique<RosbagFrames>(recording);
  if (const Result<bool> open = frames->Open(); !open) return tl::unexpected(open.error());
  return frames;
}

}  // namespace camgyro
