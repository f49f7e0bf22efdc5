#include "frontend/readers/ros2_bag_reader.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include "frontend/readers/inside_folder.h"
#include "frontend/readers/mcap_bag.h"
#include "frontend/readers/sqlite_bag.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

constexpr char kMetadata[] = "metadata.yaml";

bool IsBagFile(const std::string& name) {
  return EndsWith(name, ".db3") || EndsWith(name, ".mcap");
}

// rosbag2's compression mode "file".
bool IsPackedBagFile(const std::string& name) {
  return EndsWith(name, ".db3.zstd") || EndsWith(name, ".mcap.zstd");
}

// The bag files of a folder, x_2 before x_10.
std::vector<std::string> FilesOf(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().string();
    if (IsBagFile(name) || IsPackedBagFile(name)) files.push_back(name);
  }
  std::sort(files.begin(), files.end(), [](const std::string& a, const std::string& b) {
    return std::make_pair(a.size(), a) < std::make_pair(b.size(), b);
  });
  return files;
}

Result<std::vector<std::string>> ListedFiles(const std::string& folder) {
  const std::string file = (fs::path(folder) / kMetadata).string();
  std::vector<std::string> files;
  try {
    const YAML::Node names =
        YAML::LoadFile(file)["rosbag2_bagfile_information"]["relative_file_paths"];
    for (const YAML::Node& name : names) {
      Result<std::string> path = PathInside(folder, name.as<std::string>(), file);
      if (!path) return tl::unexpected(path.error());
      // Before version 4 the paths begin with the folder's own name.
      const std::string beside = (fs::path(folder) / fs::path(*path).filename()).string();
      files.push_back(fs::exists(*path) ? *path : beside);
    }
  } catch (const YAML::Exception& error) {
    return BadInput(Concat(file, ":", error.mark.line + 1, ": not valid YAML: ", error.msg));
  }
  if (!files.empty()) return files;
  return BadInput(Concat(file,
                         ": lists no files, expected rosbag2_bagfile_information: "
                         "relative_file_paths: [...]"));
}

Result<std::unique_ptr<Bag>> OpenFile(const std::string& file) {
  if (IsPackedBagFile(file)) {
    return BadInput(Concat(file, ": is compressed as a whole; unpack it with `zstd -d`"));
  }
  return EndsWith(file, ".mcap") ? OpenMcap(file) : OpenSqliteBag(file);
}

// Files that one recording was split into, read one after the other. One is open at a time.
class SplitBag : public Bag {
 public:
  explicit SplitBag(std::vector<std::string> files) : files_(std::move(files)) {}

  // Learns the topics of all files.
  Status Open() {
    while (next_file_ < files_.size()) {
      if (Status status = OpenNext(); !status) return status;
    }
    return {};
  }

  Status Select(const std::vector<bool>& wanted) override {
    wanted_ = wanted;
    notes_.clear();
    next_file_ = 0;
    return OpenNext();
  }

  Result<bool> Next(BagMessage* message) override {
    for (;;) {
      const Result<bool> next = part_->Next(message);
      if (!next) return next;
      if (*next) {
        message->topic = topic_of_part_[message->topic];
        return true;
      }
      notes_.insert(notes_.end(), part_->notes().begin(), part_->notes().end());
      if (next_file_ == files_.size()) return false;
      if (Status status = OpenNext(); !status) return tl::unexpected(status.error());
    }
  }

 private:
  Status OpenNext() {
    auto part = OpenFile(files_[next_file_++]);
    if (!part) return tl::unexpected(part.error());
    part_ = std::move(*part);
    topic_of_part_.clear();
    std::vector<bool> wanted;
    for (const BagTopic& topic : part_->topics()) {
      const auto [found, is_new] = index_.emplace(topic.name, topics_.size());
      if (is_new) topics_.push_back(topic);
      topic_of_part_.push_back(found->second);
      wanted.push_back(found->second < wanted_.size() && wanted_[found->second]);
    }
    return part_->Select(wanted);
  }

  const std::vector<std::string> files_;  // one or more
  size_t next_file_ = 0;
  std::unique_ptr<Bag> part_;
  std::map<std::string, size_t> index_;  // of names into topics_
  std::vector<size_t> topic_of_part_;    // index into topics_
  std::vector<bool> wanted_;             // of each topic
};

}  // namespace

bool IsRos2Bag(const std::string& path) {
  if (fs::is_directory(path)) return !FilesOf(path).empty();
  return IsBagFile(path) || IsPackedBagFile(path);
}

Result<std::unique_ptr<Bag>> OpenRos2Bag(const std::string& path) {
  if (!fs::is_directory(path)) return OpenFile(path);
  std::vector<std::string> files = FilesOf(path);
  if (fs::exists(fs::path(path) / kMetadata)) {
    Result<std::vector<std::string>> listed = ListedFiles(path);
    if (!listed) return tl::unexpected(listed.error());
    files = std::move(*listed);
  }
  if (files.empty()) return BadInput(path + ": holds no .db3 or .mcap any more");
  auto bag = std::make_unique<SplitBag>(std::move(files));
  if (Status open = bag->Open(); !open) return tl::unexpected(open.error());
  return bag;
}

}  // namespace camgyro
