// Bags of ROS 2 for tests, written byte by byte: messages in CDR, in MCAP and in SQLite.
#ifndef CAMGYRO_TESTS_FRONTEND_READERS_ROS2_BAG_BYTES_H_
#define CAMGYRO_TESTS_FRONTEND_READERS_ROS2_BAG_BYTES_H_

#include <gmock/gmock.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zstd.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace camgyro {

template <typename T>
std::string Raw(T value, bool big_endian = false) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

// A message in CDR: values aligned to their size behind the four bytes of the encapsulation.
class Cdr {
 public:
  explicit Cdr(int64_t stamp_ns, bool big_endian = false) : big_endian_(big_endian) {
    bytes_ = std::string({'\0', big_endian ? '\0' : '\1', '\0', '\0'});
    Add(static_cast<int32_t>(stamp_ns / 1000000000));
    Add(static_cast<uint32_t>(stamp_ns % 1000000000));
    Text("a_frame");
  }
  template <typename T>
  void Add(T value) {
    bytes_.resize(4 + (bytes_.size() - 4 + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    bytes_ += Raw(value, big_endian_);
  }
  void Text(const std::string& text) {
    Add(static_cast<uint32_t>(text.size() + 1));
    bytes_ += text + '\0';
  }
  void Octets(const std::string& octets) {
    Add(static_cast<uint32_t>(octets.size()));
    bytes_ += octets;
  }
  void Numbers(const std::vector<double>& values) {
    for (const double value : values) Add(value);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  const bool big_endian_;
  std::string bytes_;
};

inline std::string Imu(int64_t stamp_ns, double wx, bool big_endian = false) {
  Cdr cdr(stamp_ns, big_endian);
  cdr.Numbers(std::vector<double>(4 + 9, 0.0));
  cdr.Numbers({wx, wx == 0.0 ? 0.0 : 0.5, 0.0});
  cdr.Numbers(std::vector<double>(9, 0.0));
  cdr.Numbers({0.0, 0.0, 9.75});
  cdr.Numbers(std::vector<double>(9, 0.0));
  return cdr.bytes();
}

// 4 x 2 pixels in rows of 16 bytes, all of one value.
inline std::string Image(int64_t stamp_ns, const std::string& encoding, uint8_t value,
                         uint32_t width = 4) {
  Cdr cdr(stamp_ns);
  cdr.Add(uint32_t{2});
  cdr.Add(width);
  cdr.Text(encoding);
  cdr.Add(uint8_t{0});
  cdr.Add(uint32_t{16});
  cdr.Octets(std::string(32, static_cast<char>(value)));
  return cdr.bytes();
}

inline std::string CompressedImage(int64_t stamp_ns, int value) {
  std::vector<uint8_t> png;
  cv::imencode(".png", cv::Mat(2, 4, CV_8UC1, cv::Scalar(value)), png);
  Cdr cdr(stamp_ns);
  cdr.Text("png");
  cdr.Octets(std::string(png.begin(), png.end()));
  return cdr.bytes();
}

inline std::string CameraInfo(uint32_t width) {
  Cdr cdr(1000000000);
  cdr.Add(uint32_t{2});
  cdr.Add(width);
  cdr.Text("plumb_bob");
  cdr.Add(uint32_t{5});
  cdr.Numbers({-0.25, 0.125, 0.001, 0.002, 0.0});
  cdr.Numbers({3.5, 0, 1.5, 0, 3.0, 0.75, 0, 0, 1});
  cdr.Numbers({1, 0, 0, 0, 1, 0, 0, 0, 1});
  cdr.Numbers({9.5, 0, 1.5, 0, 0, 9.0, 0.5, 0, 0, 0, 1, 0});
  return cdr.bytes();
}

struct Message {
  std::string topic, type, data;
};

// Two IMU samples, three pictures of different encodings, intrinsics, and something else.
inline std::vector<Message> Drive() {
  const std::string imu = "sensor_msgs/msg/Imu", image = "sensor_msgs/msg/Image";
  return {{"/cam/camera_info", "sensor_msgs/msg/CameraInfo", CameraInfo(4)},
          {"/imu", imu, Imu(1700000000500000000, 0.25)},
          {"/cam/image_raw", image, Image(1700000000250000000, "mono8", 90)},
          {"/tf", "tf2_msgs/msg/TFMessage", "\1\2\3"},
          {"/cam/image_raw", image, Image(1700000000500000000, "rgb8", 120)},
          {"/imu", imu, Imu(1700000000505000000, -0.25, /*big_endian=*/true)},
          {"/cam/image_raw", image, Image(1700000000750000000, "yuv422_yuy2", 150)}};
}

inline std::string Sized(const std::string& text) {
  return Raw(static_cast<uint32_t>(text.size())) + text;
}
inline std::string Record(char opcode, const std::string& content) {
  return opcode + Raw(static_cast<uint64_t>(content.size())) + content;
}

inline std::string Compressed(const std::string& compression, const std::string& bytes) {
  std::string packed(bytes.size() + 1000, '\0');
  if (compression == "lz4") {
    packed.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    packed.resize(
        LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  } else if (compression == "zstd") {
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  } else {
    packed = bytes;
  }
  return packed;
}

struct McapSpec {
  bool chunks = true, summary = true;
  std::string compression;  // of chunks
  std::string encoding = "cdr";
  int64_t unpacked_size = -1;  // as chunks claim it; -1: the truth
};

// mcap.dev/spec; two messages in a chunk.
inline std::string Mcap(const std::vector<Message>& messages, const McapSpec& spec) {
  const std::string magic = "\x89MCAP0\r\n";
  std::string file = magic + Record(1, Sized("ros2") + Sized("a test"));
  std::string channels, chunk;
  std::vector<std::string> topics;
  const auto close_chunk = [&] {
    const int64_t size =
        spec.unpacked_size < 0 ? static_cast<int64_t>(chunk.size()) : spec.unpacked_size;
    const std::string packed = Compressed(spec.compression, chunk);
    file += Record(6, std::string(16, '\0') + Raw(size) + Raw(uint32_t{0}) +
                          Sized(spec.compression) + Raw(uint64_t{packed.size()}) + packed);
    file += Record(7, std::string(6, '\0'));  // an index, which is not read
    chunk.clear();
  };
  for (size_t i = 0; i < messages.size(); ++i) {
    const Message& message = messages[i];
    size_t topic = 0;
    while (topic < topics.size() && topics[topic] != message.topic) ++topic;
    const auto id = static_cast<uint16_t>(topic + 1);
    std::string& to = spec.chunks ? chunk : file;
    if (topic == topics.size()) {
      topics.push_back(message.topic);
      const std::string channel =
          Record(3, Raw(id) + Sized(message.type) + Sized("ros2msg") + Sized("")) +
          Record(4, Raw(id) + Raw(id) + Sized(message.topic) + Sized(spec.encoding) + Sized(""));
      channels += channel;
      to += channel;
    }
    to += Record(5, Raw(id) + Raw(static_cast<uint32_t>(i)) + std::string(16, '\0') + message.data);
    if (spec.chunks && (i % 2 == 1 || i + 1 == messages.size())) close_chunk();
  }
  file += Record(15, std::string(4, '\0'));
  const uint64_t summary = spec.summary ? file.size() : 0;
  if (spec.summary) file += channels;
  return file + Record(2, Raw(summary) + Raw(uint64_t{0}) + Raw(uint32_t{0})) + magic;
}

inline void Execute(sqlite3* database, const std::string& query) {
  ASSERT_EQ(sqlite3_exec(database, query.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
}

// The tables of rosbag2_storage_sqlite3.
inline void WriteSqlite(const std::string& path, const std::vector<Message>& messages,
                        const std::string& compression = "") {
  std::filesystem::remove(path);
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  Execute(database,
          "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
          " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
          "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
          " timestamp INTEGER NOT NULL, data BLOB NOT NULL);");
  std::vector<std::string> topics;
  for (const Message& message : messages) {
    size_t topic = 0;
    while (topic < topics.size() && topics[topic] != message.topic) ++topic;
    const std::string id = std::to_string(topic + 5);
    if (topic == topics.size()) {
      topics.push_back(message.topic);
      Execute(database, "INSERT INTO topics VALUES(" + id + ",'" + message.topic + "','" +
                            message.type + "','cdr','')");
    }
    const std::string data = Compressed(compression, message.data);
    std::string hex;
    for (const char c : data) {
      constexpr char kDigits[] = "0123456789abcdef";
      hex += kDigits[static_cast<uint8_t>(c) >> 4];
      hex += kDigits[static_cast<uint8_t>(c) & 15];
    }
    Execute(database,
            "INSERT INTO messages(topic_id, timestamp, data) VALUES(" + id + ",7,x'" + hex + "')");
  }
  sqlite3_close(database);
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_READERS_ROS2_BAG_BYTES_H_
