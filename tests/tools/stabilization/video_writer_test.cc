#include "tools/stabilization/video_writer.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>

#include "frontend/readers/video_container.h"

namespace camgyro {
namespace {

using testing::ElementsAre;

// Of a logger that stamps what it has waited for: the units of the file's time are longer than what
// is between the second picture and the third.
TEST(VideoWriter, WritesPicturesThatCameTogether) {
  const std::string file =
      (std::filesystem::path(testing::TempDir()) / "camgyro_came_together.mp4").string();
  VideoWriterOptions options;
  options.width_px = 64;
  options.height_px = 48;
  auto writer = VideoWriter::Open(file, "mp4", options);
  ASSERT_TRUE(writer) << writer.error().message;
  const cv::Mat picture(48 * 3 / 2, 64, CV_8UC1, cv::Scalar(128));
  for (const int64_t stamp_ns : {0, 40000000, 40001000, 80000000}) {
    const Status written = (*writer)->Write(picture, stamp_ns);
    ASSERT_TRUE(written) << written.error().message;
  }
  ASSERT_TRUE((*writer)->Close());
  const auto video = ReadVideoContainer(file);
  std::filesystem::remove(file);
  ASSERT_TRUE(video) << video.error().message;
  EXPECT_THAT(video->stamps_ns, ElementsAre(0, 40000000, 40011111, 80000000));
}

}  // namespace
}  // namespace camgyro
