#include "frontend/readers/frame_order.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/frontend/readers/write_video.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

constexpr int64_t kInterval = 33'000'000;

// Frames of these stamps, each with a track and an attitude of its own; as a reader would.
Status Read(const std::vector<int64_t>& stamps_ns, Recording* recording) {
  FrameOrder order;
  for (size_t i = 0; i < stamps_ns.size(); ++i) {
    Frame frame;
    frame.stamp_ns = stamps_ns[i];
    order.Add(
        frame, [&] { return "data.csv:" + std::to_string(i + 1); }, &recording->frames);
    recording->tracks.push_back({{static_cast<int64_t>(i), {0.0, 0.0}}});
  }
  return order.Mend("data.csv", recording);
}

std::vector<int64_t> CleanStamps(int count) {
  std::vector<int64_t> stamps_ns;
  for (int i = 0; i < count; ++i) stamps_ns.push_back(i * kInterval);
  return stamps_ns;
}

TEST(FrameOrder, ARepeatedStampLosesItsFrame) {
  std::vector<int64_t> stamps_ns = CleanStamps(40);
  stamps_ns[17] = stamps_ns[16];
  Recording recording;
  ASSERT_TRUE(Read(stamps_ns, &recording));
  ASSERT_EQ(recording.frames.size(), 39u);
  for (size_t i = 0; i < 39; ++i) {
    const size_t picture = i + (i > 16 ? 1 : 0);
    EXPECT_EQ(recording.frames[i].stamp_ns, stamps_ns[picture]);
    EXPECT_EQ(recording.PictureOf(i), picture);
    EXPECT_EQ(recording.tracks[i][0].track_id, static_cast<int64_t>(picture));
  }
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].name, "frame_stamps_repeat");
  EXPECT_EQ(recording.faults[0].count, 1);
  EXPECT_THAT(recording.faults[0].finding, HasSubstr("data.csv:18: timestamp"));
}

TEST(FrameOrder, OfStampsThatStepBackTheLongestOrderStays) {
  std::vector<int64_t> stamps_ns = CleanStamps(100);
  stamps_ns[20] -= 2 * kInterval;
  stamps_ns[60] += 1'000 * kInterval;  // ahead of all that follow
  Recording recording;
  ASSERT_TRUE(Read(stamps_ns, &recording));
  ASSERT_EQ(recording.frames.size(), 98u);
  for (size_t i = 1; i < 98; ++i) {
    EXPECT_GT(recording.frames[i].stamp_ns, recording.frames[i - 1].stamp_ns);
    EXPECT_NE(recording.PictureOf(i), 20u);
    EXPECT_NE(recording.PictureOf(i), 60u);
  }
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].name, "frame_stamps_step_back");
  EXPECT_EQ(recording.faults[0].count, 2);
  EXPECT_THAT(recording.faults[0].finding, HasSubstr("data.csv:21: timestamp"));
}

TEST(FrameOrder, RefusesWhatIsNotAFew) {
  std::vector<int64_t> stamps_ns = CleanStamps(40);
  for (const size_t i : {10u, 20u, 30u}) stamps_ns[i] = stamps_ns[i - 1];
  Recording recording;
  const Status status = Read(stamps_ns, &recording);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(status.error().message, HasSubstr("data.csv:11: timestamp 297000000 repeats"));
  EXPECT_THAT(status.error().message, HasSubstr("3 of 40 frames"));
}

TEST(FrameOrder, CleanStampsAreLeftAlone) {
  Recording recording;
  ASSERT_TRUE(Read(CleanStamps(40), &recording));
  EXPECT_EQ(recording.frames.size(), 40u);
  EXPECT_TRUE(recording.faults.empty());
  EXPECT_TRUE(recording.notes.empty());
}

// The pictures of a video are counted as they are decoded: those that were left out are skipped.
TEST(FrameOrder, FramesOfAVideoKeepTheirPictures) {
  const RecordingFolder folder;
  folder.Write(TrackRecording());
  folder.Remove("cam0/tracks.csv");
  VideoSpec spec;
  std::string table;
  for (int i = 0; i < 60; ++i) {
    spec.pictures.emplace_back(48, 64, CV_8UC1, cv::Scalar(40 + 3 * i));
    const int stamp = i == 30 ? 27 : i == 59 ? 58 : i;  // one steps back, the last repeats
    table += std::to_string(1'000'000'000 + stamp * kInterval) + ",\n";
  }
  ASSERT_TRUE(WriteVideo(folder.File("cam0/video.mp4"), spec));
  folder.Write("cam0/data.csv", table);
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 58u);
  auto frames = OpenFrames(*recording);
  ASSERT_TRUE(frames) << frames.error().message;
  cv::Mat gray;
  for (int i = 0; i < 58; ++i) {
    const Result<bool> more = (*frames)->Next(&gray);
    ASSERT_TRUE(more) << more.error().message;
    ASSERT_TRUE(*more);
    const int picture = i < 30 ? i : i + 1;
    EXPECT_EQ(recording->frames[static_cast<size_t>(i)].stamp_ns,
              1'000'000'000 + picture * kInterval);
    EXPECT_NEAR(gray.at<uint8_t>(20, 30), 40 + 3 * picture, 1);
  }
  EXPECT_FALSE((*frames)->Next(&gray).value());
  const Result<Recording> strict = ReadRecording(folder.path(), {StampsMode::kAuto, true});
  ASSERT_FALSE(strict);
  EXPECT_THAT(strict.error().message, HasSubstr("cam0/data.csv:31: timestamp"));
}

}  // namespace
}  // namespace camgyro
