#include "frontend/readers/bag.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "frontend/readers/frame_order.h"
#include "frontend/readers/image_file.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

bool IsImu(BagType type) { return type == BagType::kImu; }
bool IsPicture(BagType type) {
  return type == BagType::kImage || type == BagType::kCompressedImage;
}

// Where a message stands, for complaints.
std::string Place(const std::string& path, const BagTopic& topic, size_t index) {
  return Concat(path, ": ", topic.name, ", message ", index + 1);
}

bool IsDepth(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.find("depth") != std::string::npos;
}

std::string Parent(const std::string& topic) {
  const size_t slash = topic.rfind('/');
  return slash == std::string::npos ? "" : topic.substr(0, slash);
}

// Drivers publish X/camera_info for X/image and X/image/compressed.
bool IsBeside(const std::string& info, const std::string& image) {
  return Parent(info) == Parent(image) || Parent(info) == Parent(Parent(image));
}

std::string ListTopics(const std::vector<BagTopic>& topics) {
  std::string list;
  for (const BagTopic& topic : topics) {
    list += Concat(list.empty() ? "" : ", ", topic.name, " (", topic.type_name, ")");
  }
  return list.empty() ? "none" : list;
}

// Indices of the topics of a type, the preferred first; only that of the wanted name, if there is
// one. `what`: the type, for the complaint if there is none.
Result<std::vector<size_t>> Candidates(const std::string& path, const std::vector<BagTopic>& topics,
                                       const char* what, bool (*is_type)(BagType),
                                       const std::string& wanted) {
  std::vector<size_t> found;
  for (size_t i = 0; i < topics.size(); ++i) {
    if (is_type(topics[i].type) && (wanted.empty() || topics[i].name == wanted)) found.push_back(i);
  }
  if (found.empty()) {
    return BadInput(Concat(path, ": has no topic ", wanted, wanted.empty() ? "" : " ", "of ", what,
                           "; it has ", ListTopics(topics)));
  }
  std::sort(found.begin(), found.end(), [&](size_t a, size_t b) {
    return std::make_pair(IsDepth(topics[a].name), topics[a].name) <
           std::make_pair(IsDepth(topics[b].name), topics[b].name);
  });
  return found;
}

Result<std::vector<size_t>> PictureTopics(const std::string& path,
                                          const std::vector<BagTopic>& topics,
                                          const BagTopics& wanted) {
  return Candidates(path, topics, "sensor_msgs/Image or CompressedImage", IsPicture, wanted.image);
}

void NoteChoice(const std::string& path, const char* what, const char* key,
                const std::vector<BagTopic>& topics, const std::vector<size_t>& candidates,
                size_t taken, Recording* recording) {
  if (candidates.size() < 2) return;
  std::string others;
  for (const size_t i : candidates) {
    if (i != taken) others += (others.empty() ? "" : ", ") + topics[i].name;
  }
  recording->notes.push_back(Concat(
      path, ": has ", candidates.size(), " topics of ", what, "; took ", topics[taken].name,
      ", not ", others, " (to take another one, name it as `", key, "` in a recording.yaml)"));
}

Result<cv::Mat> Gray(const BagMessage& message) {
  if (const auto* image = std::get_if<RosImage>(&message.content)) return GrayFromRosImage(*image);
  const auto* compressed = std::get_if<BagCompressedImage>(&message.content);
  if (compressed == nullptr) return BadInput("is no image");
  return DecodeGrayImage(compressed->data);
}

bool AllFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

// The intrinsics of a camera that somebody has calibrated (drivers send zeros else) for pictures of
// this size.
void TakeCameraInfo(const std::string& place, const BagCameraInfo& info, bool is_rectified,
                    Recording* recording) {
  CameraGuess& camera = recording->camera;
  const Eigen::Vector4d& k = is_rectified ? info.rectified : info.raw;
  if (!k.allFinite() || !(k[0] > 0.0) || !(k[1] > 0.0)) return;
  if (info.width != static_cast<uint32_t>(camera.width_px) ||
      info.height != static_cast<uint32_t>(camera.height_px)) {
    recording->notes.push_back(Concat(place, " is of ", info.width, " x ", info.height,
                                      " pixels, the pictures have ", camera.width_px, " x ",
                                      camera.height_px, "; it is not used"));
    return;
  }
  camera.focal_px = k[1];
  camera.aspect_ratio = k[0] / k[1];
  camera.principal_px = Eigen::Vector2d(k[2], k[3]);
  const std::vector<double>& d = info.distortion;
  if (is_rectified || !AllFinite(d)) return;
  if (info.distortion_model == "equidistant" && d.size() == 4) {
    camera.distortion_model = DistortionModel::kKannalaBrandt;
    camera.distortion = d;
  } else if (info.distortion_model == "plumb_bob" && d.size() == 5 && d[4] == 0.0) {
    camera.distortion_model = DistortionModel::kRadTan;
    camera.distortion.assign(d.begin(), d.begin() + 4);
  }
}

// The samples of one of the IMU topics, until it is known which one is taken.
struct ImuTopic {
  Recording samples;
  GyroCollector collector{&samples};
  size_t messages = 0;
  bool turns = false;
  Status status;  // the first thing that is wrong; of no interest if another topic is taken
};

// Reads all messages once: samples of all IMU topics, stamps of the picture topic.
class BagPass {
 public:
  BagPass(const std::string& path, Bag* bag, size_t image, std::optional<size_t> info,
          const std::vector<size_t>& imus, Recording* recording)
      : path_(path), bag_(bag), image_(image), info_(info), recording_(recording) {
    for (const size_t imu : imus) imus_[imu];
  }

  Status Run() {
    std::vector<bool> wanted(bag_->topics().size(), false);
    wanted[image_] = true;
    if (info_) wanted[*info_] = true;
    for (const auto& imu : imus_) wanted[imu.first] = true;
    if (Status status = bag_->Select(wanted); !status) return status;
    for (BagMessage message;;) {
      const Result<bool> next = bag_->Next(&message);
      if (!next) return tl::unexpected(next.error());
      if (!*next) break;
      if (Status status = Take(message); !status) return status;
    }
    std::vector<std::string>& notes = recording_->notes;
    notes.insert(notes.end(), bag_->notes().begin(), bag_->notes().end());
    recording_->video_file = path_;
    const std::string& image_name = bag_->topics()[image_].name;
    if (info_message_) {
      const bool is_rectified = image_name.find("rect") != std::string::npos;
      TakeCameraInfo(Concat(path_, ": ", bag_->topics()[*info_].name), *info_message_, is_rectified,
                     recording_);
    }
    const std::string where = Concat(path_, ": ", image_name);
    if (Status frames = CheckFrames(where, recording_->frames); !frames) return frames;
    return order_.Mend(where, recording_);
  }

  // Of these IMU topics, in this order, the one that is taken; its samples go into the recording.
  Result<size_t> FinishImu(const std::vector<size_t>& imus) {
    auto taken =
        std::find_if(imus.begin(), imus.end(), [this](size_t imu) { return imus_[imu].turns; });
    if (taken == imus.end()) taken = imus.begin();
    ImuTopic& topic = imus_[*taken];
    if (topic.status) {
      topic.status = topic.collector.Finish(Concat(path_, ": ", bag_->topics()[*taken].name));
    }
    if (!topic.status) return tl::unexpected(topic.status.error());
    recording_->gyro = std::move(topic.samples.gyro);
    recording_->accel = std::move(topic.samples.accel);
    for (std::string& note : topic.samples.notes) recording_->notes.push_back(std::move(note));
    for (RecordedFault& fault : topic.samples.faults) {
      recording_->faults.push_back(std::move(fault));
    }
    return *taken;
  }

 private:
  Status Take(const BagMessage& message) {
    if (message.topic == image_) return TakePicture(message);
    const auto imu_topic = imus_.find(message.topic);
    if (const auto* imu = std::get_if<BagImu>(&message.content); imu && imu_topic != imus_.end()) {
      TakeImu(message, *imu, &imu_topic->second);
    } else if (const auto* info = std::get_if<BagCameraInfo>(&message.content)) {
      if (!info_message_) info_message_ = *info;
    }
    return {};
  }

  void TakeImu(const BagMessage& message, const BagImu& imu, ImuTopic* topic) {
    const std::string place = Place(path_, bag_->topics()[message.topic], topic->messages++);
    topic->turns = topic->turns || imu.rates_rad_s != Eigen::Vector3d::Zero();
    if (!topic->status) return;
    if (!imu.rates_rad_s.allFinite() || !imu.accel_m_s2.allFinite()) {
      topic->status = BadInput(place + ": angular_velocity or linear_acceleration is not finite");
      return;
    }
    topic->collector.Add({message.stamp_ns, imu.rates_rad_s}, imu.accel_m_s2,
                         [&] { return place; });
  }

  Status TakePicture(const BagMessage& message) {
    std::vector<Frame>& frames = recording_->frames;
    const std::string place = Place(path_, bag_->topics()[image_], frames.size());
    if (frames.empty()) {
      const Result<cv::Mat> first = Gray(message);
      if (!first) return BadInput(place + ": " + first.error().message);
      recording_->camera.width_px = first->cols;
      recording_->camera.height_px = first->rows;
    }
    Frame frame;
    frame.stamp_ns = message.stamp_ns;
    order_.Add(
        std::move(frame), [&] { return place; }, &frames);
    return {};
  }

  const std::string& path_;
  Bag* const bag_;
  const size_t image_;
  const std::optional<size_t> info_;
  Recording* const recording_;
  std::map<size_t, ImuTopic> imus_;
  FrameOrder order_;
  std::optional<BagCameraInfo> info_message_;
};

class BagFrames : public FrameSource {
 public:
  BagFrames(const Recording& recording, const std::string& path, std::unique_ptr<Bag> bag,
            size_t topic)
      : FrameSource(recording), path_(path), bag_(std::move(bag)), topic_(bag_->topics()[topic]) {}

 protected:
  Result<bool> Decode(Decoded* decoded) override {
    if (next_ == recording_.frames.size()) return false;
    BagMessage message;
    do {
      const Result<bool> next = bag_->Next(&message);
      if (!next) return next;
      if (!*next) return BadInput(Concat(path_, ": ", topic_.name, " ends after picture ", next_));
    } while (pictures_++ < recording_.PictureOf(next_));
    decoded->place = Place(path_, topic_, pictures_ - 1);
    Result<cv::Mat> image = Gray(message);
    if (!image) return BadInput(decoded->place + ": " + image.error().message);
    decoded->width_px = image->cols;
    decoded->height_px = image->rows;
    decoded->picture = std::move(*image);
    return true;
  }

 private:
  const std::string path_;
  const std::unique_ptr<Bag> bag_;
  const BagTopic topic_;
  size_t pictures_ = 0;  // read
};

}  // namespace

BagType BagTypeOf(const std::string& name) {
  static const std::map<std::string, BagType> types = {
      {"Imu", BagType::kImu},
      {"Image", BagType::kImage},
      {"CompressedImage", BagType::kCompressedImage},
      {"CameraInfo", BagType::kCameraInfo}};
  for (const std::string package : {"sensor_msgs/msg/", "sensor_msgs/"}) {
    if (name.compare(0, package.size(), package) != 0) continue;
    const auto found = types.find(name.substr(package.size()));
    if (found != types.end()) return found->second;
  }
  return BagType::kOther;
}

Result<Recording> ReadBag(const std::string& path, OpenBag open, const BagTopics& wanted) {
  const auto bag = open(path);
  if (!bag) return tl::unexpected(bag.error());
  const std::vector<BagTopic>& topics = (*bag)->topics();
  const auto imus = Candidates(path, topics, "sensor_msgs/Imu", IsImu, wanted.imu);
  if (!imus) return tl::unexpected(imus.error());
  const auto images = PictureTopics(path, topics, wanted);
  if (!images) return tl::unexpected(images.error());
  const size_t image = images->front();
  std::optional<size_t> info;
  for (size_t i = 0; i < topics.size(); ++i) {
    if (topics[i].type == BagType::kCameraInfo && IsBeside(topics[i].name, topics[image].name)) {
      info = i;
    }
  }

  Recording recording;
  recording.path = path;
  NoteChoice(path, "pictures", "image_topic", topics, *images, image, &recording);
  BagPass pass(path, bag->get(), image, info, *imus, &recording);
  if (const Status read = pass.Run(); !read) return tl::unexpected(read.error());
  const Result<size_t> imu = pass.FinishImu(*imus);
  if (!imu) return tl::unexpected(imu.error());
  NoteChoice(path, "sensor_msgs/Imu", "imu_topic", topics, *imus, *imu, &recording);
  NoteClocks(&recording);
  return recording;
}

Result<std::unique_ptr<FrameSource>> OpenBagFrames(const Recording& recording,
                                                   const std::string& path, OpenBag open,
                                                   const BagTopics& wanted) {
  auto bag = open(path);
  if (!bag) return tl::unexpected(bag.error());
  const auto images = PictureTopics(path, (*bag)->topics(), wanted);
  if (!images) return tl::unexpected(images.error());
  std::vector<bool> selected((*bag)->topics().size(), false);
  selected[images->front()] = true;
  if (Status status = (*bag)->Select(selected); !status) return tl::unexpected(status.error());
  return std::make_unique<BagFrames>(recording, path, std::move(*bag), images->front());
}

}  // namespace camgyro
