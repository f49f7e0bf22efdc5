#include "tests/fuzz/seeds.h"

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <vector>
#ifdef CAMGYRO_TEST_ROSBAG
#include <rosbag/bag.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#endif

#include "estimator/calibrate.h"
#include "pipeline/result_files.h"
#include "tests/frontend/readers/gpmf_bytes.h"
#include "tests/frontend/readers/ros2_bag_bytes.h"
#include "tests/frontend/readers/video_meta_bytes.h"
#include "tests/frontend/readers/write_video.h"
#include "tests/paths.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

std::string Content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// The bytes of a file that somebody else's library writes.
std::string Written(const std::string& name, const std::function<void(const std::string&)>& write) {
  const fs::path file =
      fs::temp_directory_path() / ("camgyro_seed_" + std::to_string(getpid()) + name);
  write(file.string());
  const std::string bytes = Content(file);
  fs::remove(file);
  return bytes;
}

VideoSpec Clip(int frames) {
  VideoSpec spec;
  spec.pictures.assign(static_cast<size_t>(frames), cv::Mat(48, 64, CV_8UC1, cv::Scalar(90)));
  return spec;
}

}  // namespace

std::string VideoBytes() {
  return Written(".mp4", [](const std::string& file) { WriteVideo(file, Clip(3)); });
}

std::string GoProBytes() {
  return Written(".mp4", [](const std::string& file) {
    VideoSpec spec = Clip(50);
    for (int second = 0; second < 2; ++second) spec.gpmf.emplace_back(Telemetry(second), second);
    WriteVideo(file, spec);
  });
}

std::string Telemetry(int second) {
  std::vector<int16_t> samples;
  for (int i = 0; i < 20; ++i) {
    samples.insert(samples.end(), {200, static_cast<int16_t>(20 * second + i), 300});
  }
  const std::string gyro = GpmfItemBytes("STMP", 'J', 8, 1, BigEndianBytes(1000000 * second, 8)) +
                           GpmfLong("TSMP", static_cast<uint32_t>(20 * (second + 1))) +
                           GpmfText("SIUN", "rad/s") + GpmfShort("SCAL", 1000) +
                           GpmfText("ORIN", "YxZ") + GpmfTriples("GYRO", samples);
  return GpmfNested("DEVC",
                    GpmfText("DVNM", "Test camera") + GpmfNested("STRM", gyro) +
                        GpmfNested("STRM", GpmfFloats("SHUT", std::vector<float>(25, 0.004f))) +
                        GpmfNested("STRM", GpmfFloats("SROT", std::vector<float>(25, 16.5f))));
}

std::string PictureBytes(const std::string& extension) {
  std::vector<uint8_t> bytes;
  cv::imencode(extension, cv::Mat(48, 64, CV_8UC1, cv::Scalar(90)), bytes);
  return {bytes.begin(), bytes.end()};
}

std::string SqliteBytes(int begin, int end, const std::string& compression) {
  return Written(".db3", [&](const std::string& file) {
    const std::vector<Message> drive = Drive();
    WriteSqlite(file, {drive.begin() + begin, drive.begin() + end}, compression);
  });
}

std::string RosbagBytes(bool compressed) {
#ifdef CAMGYRO_TEST_ROSBAG
  return Written(".bag", [&](const std::string& file) {
    rosbag::Bag bag(file, rosbag::bagmode::Write);
    bag.setCompression(compressed ? rosbag::compression::LZ4 : rosbag::compression::Uncompressed);
    const ros::Time arrival(1700000000.0);
    sensor_msgs::Imu imu;
    sensor_msgs::Image image;
    imu.angular_velocity.x = 0.25;
    image.encoding = "mono8";
    image.width = image.step = 4;
    image.height = 2;
    image.data.assign(8, 90);
    for (int i = 0; i < 3; ++i) {
      imu.header.stamp = ros::Time(1700000000.5 + 0.005 * i);
      image.header.stamp = ros::Time(1700000000.5 + 0.04 * i);
      bag.write("/imu", arrival, imu);
      bag.write("/cam", arrival, image);
    }
  });
#else
  static_cast<void>(compressed);
  return "";
#endif
}

std::string VideoMetaBytes() {
  using namespace video_meta;  // NOLINT(google-build-using-namespace)
  return Bytes(1, Whole(1, 1600000000)) + Bytes(2, Whole(3, 1) + Whole(4, 1)) +
         Imu(1000000000, {0.25f, 0.5f, 0.75f}) + Picture(1000000000, 0) +
         Imu(1005000000, {-0.25f, 0.5f, 0.75f}) + Picture(1040100000, 1);
}

std::string CalibrationBytes() {
  CalibrationReport report;
  Calibration& c = report.calibration;
  c.width_px = 320;
  c.height_px = 240;
  c.distortion_model = DistortionModel::kRadTan;
  c.lens << 290.125, 161.5, 118.25, 1.0625, -0.25, 0.0625, 0.5e-3, -0.25e-3, 0.0, 0.0, 0.0, 0.0;
  c.covariance.setIdentity();
  c.determined.fill(true);
  c.determined[kStateReadout] = false;
  return CalibrationYaml(report, /*attitudes=*/false);
}

std::string TruthBytes() { return Content(fs::path(SourceDir()) / "tools/sample/truth.yaml"); }

}  // namespace camgyro
