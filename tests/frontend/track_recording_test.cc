// Pictures that cannot be tracked are left out, and counted.
#include "frontend/track_recording.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/recording_folder.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

constexpr int64_t kInterval = 33'000'000;
constexpr int kFrames = 12;

cv::Mat Noise(int width, int height, double mean, double sigma) {
  cv::Mat noise(height, width, CV_8UC1);
  cv::theRNG().state = 3;
  cv::randn(noise, mean, sigma);
  return noise;
}

// Blobs that move by 3 px per frame.
cv::Mat Scene(int frame) {
  cv::Mat wide;
  cv::GaussianBlur(Noise(400, 180, 128.0, 90.0), wide, {}, 2.0);
  cv::normalize(wide, wide, 20.0, 230.0, cv::NORM_MINMAX);
  return wide(cv::Rect(3 * frame, 0, 240, 180)).clone();
}

cv::Mat Enlarged(const cv::Mat& picture) {
  cv::Mat enlarged;
  cv::resize(picture, enlarged, {}, 4.0, 4.0);
  return enlarged;
}

// What the sensor gives in the dark, with its gain at the limit.
cv::Mat Dark() { return Noise(240, 180, 18.0, 16.0); }

// Frames of Scene, but those that `change` changes.
template <typename Change>
Result<Recording> Pictures(const RecordingFolder& folder, const Change& change) {
  folder.Write(TrackRecording());
  folder.Remove("cam0/tracks.csv");
  folder.Remove("cam0/sensor.yaml");
  std::filesystem::create_directories(folder.File("cam0/data"));
  std::string table;
  for (int i = 0; i < kFrames; ++i) {
    const std::string name = std::to_string(i) + ".png";
    cv::Mat picture = Scene(i);
    change(i, &picture);
    EXPECT_TRUE(cv::imwrite(folder.File("cam0/data/" + name), picture));
    table += std::to_string(1'000'000'000 + i * kInterval) + "," + name + "\n";
  }
  folder.Write("cam0/data.csv", table);
  return ReadRecording(folder.path());
}

TEST(ShowsNothing, KnowsTheDarkFromAScene) {
  EXPECT_TRUE(ShowsNothing(Dark()));
  EXPECT_TRUE(ShowsNothing(cv::Mat(180, 240, CV_8UC1, cv::Scalar(255))));
  EXPECT_TRUE(ShowsNothing(cv::Mat(1, 1, CV_8UC1, cv::Scalar(7))));
  EXPECT_FALSE(ShowsNothing(Scene(0)));
  cv::Mat dim;  // a scene at dusk
  Scene(0).convertTo(dim, CV_8UC1, 0.2, 10.0);
  EXPECT_FALSE(ShowsNothing(dim));
}

TEST(TrackRecording, KeepsPicturesOfAFewFramesForPeople) {
  const RecordingFolder folder;
  auto recording = Pictures(folder, [](int i, cv::Mat* picture) {
    if (i == 5) *picture = cv::Scalar(18.0);  // a lens cap
    *picture = Enlarged(*picture);
  });
  ASSERT_TRUE(recording) << recording.error().message;
  const auto summary = TrackRecording({}, nullptr, nullptr, &*recording);
  ASSERT_TRUE(summary) << summary.error().message;
  // Of 12 frames, all from 1/8 on are within a few of a place that is kept.
  EXPECT_EQ(summary->pictures.size(), 10U);
  for (const auto& [stamp_ns, picture] : summary->pictures) {
    EXPECT_EQ(picture.size(), cv::Size(512, 384));
    const auto frame = static_cast<int>((stamp_ns - 1'000'000'000) / kInterval);
    EXPECT_LT(cv::norm(picture, SmallPicture(Enlarged(Scene(frame))), cv::NORM_INF), 1.5);
  }
}

TEST(TrackRecording, LeavesOutPicturesThatShowNothing) {
  const RecordingFolder folder;
  auto recording = Pictures(folder, [](int i, cv::Mat* picture) {
    if (i >= 4 && i < 7) *picture = Dark();
  });
  ASSERT_TRUE(recording) << recording.error().message;
  const auto summary = TrackRecording({}, nullptr, nullptr, &*recording);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_EQ(recording->frames.size(), 9u);
  ASSERT_EQ(recording->tracks.size(), 9u);
  for (size_t i = 0; i < 9; ++i) {
    const int picture = static_cast<int>(i < 4 ? i : i + 3);
    EXPECT_EQ(recording->frames[i].stamp_ns, 1'000'000'000 + picture * kInterval);
    EXPECT_GT(recording->tracks[i].size(), 20u);
  }
  ASSERT_EQ(recording->faults.size(), 1u);
  EXPECT_EQ(recording->faults[0].name, "frames_without_contrast");
  EXPECT_EQ(recording->faults[0].count, 3);
  EXPECT_THAT(recording->faults[0].finding, HasSubstr("the first is frame 5"));
  for (const FramePair& pair : PairsFromTracks(recording->tracks, 1)) {
    EXPECT_EQ(pair.matches.empty(), pair.frame_a == 3);  // nothing is followed through the dark
  }
}

TEST(TrackRecording, LeavesOutPicturesOfAnotherSize) {
  const RecordingFolder folder;
  auto recording = Pictures(folder, [](int i, cv::Mat* picture) {
    if (i == 2 || i == 8) cv::resize(*picture, *picture, cv::Size(120, 90));
  });
  ASSERT_TRUE(recording) << recording.error().message;
  const auto summary = TrackRecording({}, nullptr, nullptr, &*recording);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(recording->frames.size(), 10u);
  ASSERT_EQ(recording->faults.size(), 1u);
  EXPECT_EQ(recording->faults[0].name, "frames_of_another_size");
  EXPECT_EQ(recording->faults[0].count, 2);
  EXPECT_THAT(recording->faults[0].finding,
              HasSubstr("data/2.png: frame 3 has 120 x 90 pixels, expected 240 x 180"));
}

TEST(TrackRecording, RefusesARecordingMostOfWhichHasAnotherSize) {
  const RecordingFolder folder;
  auto recording = Pictures(folder, [](int i, cv::Mat* picture) {
    if (i >= 3) cv::resize(*picture, *picture, cv::Size(120, 90));
  });
  ASSERT_TRUE(recording) << recording.error().message;
  const auto summary = TrackRecording({}, nullptr, nullptr, &*recording);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(summary.error().message,
              HasSubstr("data/3.png: frame 4 has 120 x 90 pixels, expected 240 x 180; so it is in "
                        "9 of 12 frames"));
}

// Points in every other frame, or in all but a few.
TEST(LeaveOutUntrackedFrames, OfATrackerThatSkipsFrames) {
  const auto with_points = [](const std::function<bool(size_t)>& has_points) {
    Recording recording;
    for (size_t i = 0; i < 30; ++i) {
      recording.frames.emplace_back();
      recording.frames.back().stamp_ns = static_cast<int64_t>(i) * kInterval;
      recording.tracks.emplace_back();
      if (has_points(i)) recording.tracks.back().push_back({1, {10.0, 10.0}});
    }
    return recording;
  };
  Recording every_other = with_points([](size_t i) { return i % 2 == 0; });
  LeaveOutUntrackedFrames(&every_other);
  ASSERT_EQ(every_other.frames.size(), 15u);
  ASSERT_EQ(every_other.tracks.size(), 15u);
  EXPECT_EQ(every_other.frames[3].stamp_ns, 6 * kInterval);
  ASSERT_EQ(every_other.faults.size(), 1u);
  EXPECT_EQ(every_other.faults[0].name, "frames_without_points");
  EXPECT_EQ(every_other.faults[0].count, 15);
  Recording lost_for_a_while = with_points([](size_t i) { return i < 10 || i > 15; });
  LeaveOutUntrackedFrames(&lost_for_a_while);
  EXPECT_EQ(lost_for_a_while.frames.size(), 30u);
  EXPECT_TRUE(lost_for_a_while.faults.empty());
  Recording none = with_points([](size_t) { return false; });
  LeaveOutUntrackedFrames(&none);
  EXPECT_EQ(none.frames.size(), 30u);
}

}  // namespace
}  // namespace camgyro
