// Videos of our own making: in a folder, and with GoPro telemetry inside.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <optional>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/frontend/readers/gpmf_bytes.h"
#include "tests/frontend/readers/recording_folder.h"
#include "tests/frontend/readers/write_video.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A grey level that rises from frame to frame, and a bright block that moves.
cv::Mat Picture(int frame) {
  cv::Mat picture(48, 64, CV_8UC1, cv::Scalar(50 + 2 * frame));
  picture(cv::Rect(frame % 48, 8, 16, 16)).setTo(220);
  return picture;
}

VideoSpec Video(int frames) {
  VideoSpec spec;
  for (int i = 0; i < frames; ++i) spec.pictures.push_back(Picture(i));
  return spec;
}

void WriteFolder(const RecordingFolder& folder, const VideoSpec& spec) {
  folder.Write(TrackRecording());
  for (const char* name : {"cam0/data.csv", "cam0/tracks.csv"}) folder.Remove(name);
  ASSERT_TRUE(WriteVideo(folder.File("cam0/video.mp4"), spec));
}

TEST(VideoReader, HandsOutColourPlanes) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(3));
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  auto frames = OpenFrames(*recording, PictureFormat::kI420);
  ASSERT_TRUE(frames) << frames.error().message;
  cv::Mat i420;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE((*frames)->Next(&i420).value_or(false));
    ASSERT_EQ(i420.size(), cv::Size(64, 72));
    cv::Mat luma;  // as WriteVideo scales it
    Picture(i).convertTo(luma, CV_8UC1, 219.0 / 255.0, 16.0);
    EXPECT_LT(cv::norm(i420.rowRange(0, 48), luma, cv::NORM_L1) / (64.0 * 48.0), 3.0) << i;
    EXPECT_LT(cv::norm(i420.rowRange(48, 72) - 128, cv::NORM_INF), 3.0) << i;  // no colour
  }
  EXPECT_FALSE((*frames)->Next(&i420).value());
}

// Number of frames that were handed out whole; the last answer in `end`.
int CountFrames(const Recording& recording, Result<bool>* end) {
  auto frames = OpenFrames(recording);
  EXPECT_TRUE(frames) << frames.error().message;
  cv::Mat gray;
  int count = 0;
  for (*end = (*frames)->Next(&gray); *end && **end; *end = (*frames)->Next(&gray)) {
    // MPEG-4 at its finest quantiser keeps grey levels to a few units.
    EXPECT_LT(cv::norm(gray, Picture(count), cv::NORM_L1) / (64.0 * 48.0), 3.0) << count;
    ++count;
  }
  return count;
}

TEST(VideoReader, HandsOutEveryFrameWithTheContainersStamps) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(30));
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 30u);
  EXPECT_EQ(recording->frames[0].stamp_ns, 0);
  EXPECT_EQ(recording->frames[29].stamp_ns, 29 * 40000000ll);
  EXPECT_EQ(recording->camera.width_px, 64);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("frame stamps are the container's")));
  Result<bool> end;
  EXPECT_EQ(CountFrames(*recording, &end), 30);
  EXPECT_FALSE(end.value());
}

TEST(VideoReader, SkipsToAFrame) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(60));  // a key picture in every 12
  Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  LeaveOutFrames({5, 40}, /*repeats=*/false, &*recording);
  auto frames = OpenFrames(*recording);
  ASSERT_TRUE(frames) << frames.error().message;
  const auto expect_next = [&](int picture) {
    cv::Mat gray;
    const Result<bool> read = (*frames)->Next(&gray);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_TRUE(*read);
    // Of neighbours it differs by 2 and where the block moves; of those further off by more.
    EXPECT_LT(cv::norm(gray, Picture(picture), cv::NORM_L1) / (64.0 * 48.0), 1.5) << picture;
  };
  for (const auto& [frame, picture] : {std::pair(4, 4), {30, 31}, {32, 33}, {57, 59}}) {
    ASSERT_TRUE((*frames)->SkipTo(static_cast<size_t>(frame)));
    expect_next(picture);
    if (frame == 30) {
      ASSERT_TRUE((*frames)->SkipTo(7));  // has gone by
      expect_next(32);
    }
  }
  cv::Mat gray;
  EXPECT_FALSE((*frames)->Next(&gray).value());
  ASSERT_TRUE((*frames)->SkipTo(100));  // beyond the end
  EXPECT_FALSE((*frames)->Next(&gray).value());
}

TEST(VideoReader, TakesStampsFromTheTable) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(3));
  folder.Write("cam0/data.csv", "#timestamp [ns],filename\n7000000,\n40000000,\n90000000,\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->frames[2].stamp_ns, 90000000);
  Result<bool> end;
  EXPECT_EQ(CountFrames(*recording, &end), 3);
}

TEST(VideoReader, RefusesATableOfAnotherLength) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(4));
  folder.Write("cam0/data.csv", "7000000\n40000000\n90000000\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(recording.error().message, HasSubstr("cam0/data.csv: has 3 frames, but"));
  EXPECT_THAT(recording.error().message, HasSubstr("cam0/video.mp4 has 4; expected the same"));
}

// FFmpeg would follow them, out of the folder and into the network.
TEST(VideoReader, RefusesPlaylists) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(4));
  std::filesystem::rename(folder.File("cam0/video.mp4"), folder.File("cam0/other.mp4"));
  for (const char* playlist :
       {"ffconcat version 1.0\nfile other.mp4\n",
        "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:20\n#EXTINF:20,\nother.mp4\n"
        "#EXT-X-ENDLIST\n"}) {
    folder.Write("cam0/video.mp4", playlist);
    const Result<Recording> recording = ReadRecording(folder.path());
    ASSERT_FALSE(recording) << playlist;
    EXPECT_THAT(recording.error().message, HasSubstr("cam0/video.mp4: cannot be read as a video"));
  }
}

TEST(VideoReader, RefusesAVideoOfAnotherSize) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(3));
  folder.Write("cam0/sensor.yaml", "resolution: [128, 96]\n");
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_FALSE(recording);
  EXPECT_THAT(recording.error().message, HasSubstr("video.mp4: the picture has 64 x 48 pixels"));
}

TEST(VideoReader, NotesARotationAndDoesNotApplyIt) {
  const RecordingFolder folder;
  VideoSpec spec = Video(3);
  spec.rotation_deg = 90;
  WriteFolder(folder, spec);
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->camera.width_px, 64);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("is to be shown rotated by 90 deg clockwise")));
  Result<bool> end;
  EXPECT_EQ(CountFrames(*recording, &end), 3);  // compares with the pictures as coded
}

// A file that was still being copied, or whose recorder ran out of space.
TEST(VideoReader, UsesWhatIsThereOfAFileThatIsCutShort) {
  for (const bool has_table : {false, true}) {
    SCOPED_TRACE(has_table);
    const RecordingFolder folder;
    VideoSpec spec = Video(30);
    spec.index_first = true;
    WriteFolder(folder, spec);
    if (has_table) {
      std::string table = "#timestamp [ns],filename\n";
      for (int i = 0; i < 30; ++i) table += std::to_string(40000000ll * i + 7) + ",\n";
      folder.Write("cam0/data.csv", table);
    }
    const std::string file = folder.File("cam0/video.mp4");
    std::filesystem::resize_file(file, std::filesystem::file_size(file) * 2 / 3);
    const Result<Recording> recording = ReadRecording(folder.path());
    ASSERT_TRUE(recording) << recording.error().message;
    const size_t whole = recording->frames.size();
    EXPECT_GT(whole, 10u);
    EXPECT_LT(whole, 25u);
    EXPECT_EQ(recording->frames.back().stamp_ns,
              40000000ll * static_cast<int64_t>(whole - 1) + (has_table ? 7 : 0));
    ASSERT_EQ(recording->faults.size(), 1u);
    EXPECT_EQ(recording->faults[0].name, "video_cut_short");
    EXPECT_EQ(recording->faults[0].count, static_cast<int>(30 - whole));
    EXPECT_THAT(recording->faults[0].finding, HasSubstr("cam0/video.mp4: the file is cut short"));
    Result<bool> end;
    EXPECT_EQ(CountFrames(*recording, &end), static_cast<int>(whole));
    ASSERT_TRUE(end) << end.error().message;
    ReadOptions options;
    options.strict = true;
    const Result<Recording> strict = ReadRecording(folder.path(), options);
    ASSERT_FALSE(strict);
    EXPECT_THAT(strict.error().message, HasSubstr("the file is cut short"));
  }
}

// An index at the end is the last that a camera writes: without it nothing says where frames are.
TEST(VideoReader, RefusesAFileThatIsCutShortBeforeItsIndex) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(30));
  const std::string file = folder.File("cam0/video.mp4");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) * 2 / 3);
  const Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(recording.error().message, HasSubstr("video.mp4: cannot be read as a video"));
}

TEST(VideoReader, NamesTheFrameWhereVideoAndRecordingDisagree) {
  const RecordingFolder folder;
  WriteFolder(folder, Video(5));
  Result<Recording> recording = ReadRecording(folder.path());
  ASSERT_TRUE(recording) << recording.error().message;
  const std::vector<Frame> five = recording->frames;
  Result<bool> end;

  recording->frames.resize(4);
  EXPECT_EQ(CountFrames(*recording, &end), 4);
  ASSERT_FALSE(end);
  EXPECT_THAT(end.error().message, HasSubstr("video.mp4: has a frame 5, expected 4 frames"));

  recording->frames = five;
  recording->frames.push_back({1000000000, 0.0, ""});
  EXPECT_EQ(CountFrames(*recording, &end), 5);
  ASSERT_FALSE(end);
  EXPECT_THAT(end.error().message, HasSubstr("video.mp4: ends after frame 5, expected 6 frames"));
}

// One second of telemetry: 100 gyro samples, stored as y, -x, z; 25 exposures and readouts.
std::string Telemetry(int payload, const std::string& unit = "rad/s",
                      const std::string& orientation = "YxZ", int64_t stamp_us = -1) {
  std::vector<int16_t> samples;
  for (int i = 0; i < 100; ++i) {
    const auto value = static_cast<int16_t>(100 * payload + i);
    samples.insert(samples.end(), {200, static_cast<int16_t>(-value), 300});
  }
  const std::string stamp =
      stamp_us < 0 ? "" : GpmfItemBytes("STMP", 'J', 8, 1, BigEndianBytes(stamp_us, 8));
  const std::string gyro = stamp + GpmfLong("TSMP", 100 * (payload + 1)) + GpmfText("SIUN", unit) +
                           GpmfShort("SCAL", 1000) + GpmfText("ORIN", orientation) +
                           GpmfTriples("GYRO", samples);
  return GpmfNested("DEVC",
                    GpmfText("DVNM", "Test camera") + GpmfNested("STRM", gyro) +
                        GpmfNested("STRM", GpmfFloats("SHUT", std::vector<float>(25, 0.004f))) +
                        GpmfNested("STRM", GpmfFloats("SROT", std::vector<float>(25, 16.5f))));
}

TEST(GoProReader, ReadsVideoAndTelemetry) {
  const RecordingFolder folder;
  VideoSpec spec = Video(75);
  for (int i = 0; i < 3; ++i) spec.gpmf.emplace_back(Telemetry(i), i);
  ASSERT_TRUE(WriteVideo(folder.File("a.mp4"), spec));
  const Result<Recording> recording = ReadRecording(folder.File("a.mp4"));
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 75u);
  EXPECT_NEAR(recording->frames[74].exposure_s, 0.004, 1e-9);
  EXPECT_NEAR(recording->camera.readout_s.value(), 0.0165, 1e-9);
  EXPECT_FALSE(recording->camera.q_gyro_cam);
  EXPECT_FALSE(recording->declared_stabilisation);
  EXPECT_THAT(recording->accel, IsEmpty());
  ASSERT_EQ(recording->gyro.size(), 300u);
  for (int i = 0; i < 300; ++i) {
    EXPECT_NEAR(static_cast<double>(recording->gyro[i].stamp_ns), i * 1e7, 1.0);
    EXPECT_LT((recording->gyro[i].omega_gyro_rad_s - Eigen::Vector3d(1e-3 * i, 0.2, 0.3)).norm(),
              1e-12);
  }
  EXPECT_THAT(recording->notes, Contains(HasSubstr("gyro axes YxZ (ORIN)")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("one line of 100 Hz")));
  Result<bool> end;
  EXPECT_EQ(CountFrames(*recording, &end), 75);
}

// Puts a GPMF box of settings behind what stands in moov/udta, the last boxes that WriteVideo's
// muxer writes.
void AppendSettings(const std::string& file, const std::string& settings) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::string box = BigEndianBytes(8 + settings.size(), 4) + "GPMF" + settings;
  for (const char* name : {"moov", "udta"}) {
    const size_t at = bytes.rfind(name);
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at - 4, 4, BigEndianBytes(bytes.size() - (at - 4) + box.size(), 4));
  }
  std::ofstream(file, std::ios::binary) << bytes << box;
}

TEST(GoProReader, ReadsTheSettingsBesideTheTracks) {
  struct Case {
    std::string items;
    std::optional<std::string> stabilisation;
  };
  const Case cases[] = {
      {GpmfText("EISE", "Y") + GpmfText("EISA", "HS Boost"), "EISE=Y, EISA=HS Boost"},
      {GpmfText("EISE", "Y"), "EISE=Y"},
      {GpmfText("EISE", "N") + GpmfText("EISA", "N/A"), std::nullopt},
      {GpmfText("EISA", "HS EIS"), "EISA=HS EIS"},
      {GpmfText("EISA", "N/A"), std::nullopt},
  };
  const RecordingFolder folder;
  const std::string file = folder.File("a.mp4");
  for (const Case& c : cases) {
    VideoSpec spec = Video(50);
    for (int i = 0; i < 2; ++i) spec.gpmf.emplace_back(Telemetry(i), i);
    ASSERT_TRUE(WriteVideo(file, spec));
    AppendSettings(file, GpmfNested("DEVC", GpmfText("DVNM", "Global Settings") +
                                                GpmfText("MINF", "HERO9 Black") +
                                                GpmfFloats("SROT", {11.25f}) + c.items));
    const Result<Recording> recording = ReadRecording(file);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->declared_stabilisation, c.stabilisation);
    EXPECT_DOUBLE_EQ(recording->camera.readout_s.value(), 0.01125);  // not the telemetry's
    EXPECT_THAT(recording->notes, Contains(HasSubstr("GoPro HERO9 Black")));
  }
}

TEST(GoProReader, CountsSamplesOfAMissingPayload) {
  const RecordingFolder folder;
  VideoSpec spec = Video(75);
  for (const int i : {0, 1, 3, 4}) spec.gpmf.emplace_back(Telemetry(i), i);
  ASSERT_TRUE(WriteVideo(folder.File("a.mp4"), spec));
  const Result<Recording> recording = ReadRecording(folder.File("a.mp4"));
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->gyro.size(), 400u);
  EXPECT_NEAR(static_cast<double>(recording->gyro[200].stamp_ns), 3e9, 1.0);  // after the gap
}

TEST(GoProReader, PrefersTheCamerasStampsToPayloadTimes) {
  const RecordingFolder folder;
  VideoSpec spec = Video(75);
  // The camera's clock says 100 samples in 0.95 s, where payloads lie 1 s apart.
  for (int i = 0; i < 3; ++i) {
    spec.gpmf.emplace_back(Telemetry(i, "rad/s", "YxZ", 7000000 + 950000 * i), i);
  }
  ASSERT_TRUE(WriteVideo(folder.File("a.mp4"), spec));
  const Result<Recording> recording = ReadRecording(folder.File("a.mp4"));
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->gyro.size(), 300u);
  EXPECT_EQ(recording->gyro[0].stamp_ns, 0);
  EXPECT_NEAR(static_cast<double>(recording->gyro[200].stamp_ns), 1.9e9, 1.0);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("the gyro ends at 2.8405 s")));
}

TEST(GoProReader, RefusesWhatItCannotUse) {
  const std::string exposures_only =
      GpmfNested("DEVC", GpmfNested("STRM", GpmfFloats("SHUT", {0.004f})));
  const std::string cut = Telemetry(0).substr(0, 400);
  struct Case {
    std::vector<std::pair<std::string, double>> gpmf;
    const char* complaint;
  };
  const Case cases[] = {
      {{},
       "a video without gyro: it has no GoPro telemetry (GPMF) stream; expected one, or a "
       "folder with the video as cam0/video.mp4 and the gyro as imu0/data.csv"},
      {{{exposures_only, 0}, {exposures_only, 1}}, "its telemetry has no gyro (GYRO)"},
      {{{Telemetry(0), 0}, {cut, 1}}, "telemetry payload 1 is malformed: item 'DEVC' needs"},
      {{{Telemetry(0, "deg/s"), 0}, {Telemetry(1, "deg/s"), 1}}, "GYRO is in 'deg/s', expected"},
      {{{Telemetry(0, "rad/s", "YXZ"), 0}, {Telemetry(1, "rad/s", "YXZ"), 1}},
       "GYRO: ORIN 'YXZ' is no right-handed order"},
      {{{Telemetry(0), 0}}, "GYRO: a clock needs at least two telemetry payloads"},
      {{{Telemetry(1), 0}, {Telemetry(0), 1}}, "GYRO: sample counts (TSMP) go back"},
      {{{Telemetry(0), 0}, {Telemetry(20000000), 1}}, "GYRO: a rate of 2e+09 Hz is not plausible"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.complaint);
    const RecordingFolder folder;
    VideoSpec spec = Video(5);
    spec.gpmf = c.gpmf;
    ASSERT_TRUE(WriteVideo(folder.File("a.mp4"), spec));
    const Result<Recording> recording = ReadRecording(folder.File("a.mp4"));
    ASSERT_FALSE(recording);
    EXPECT_EQ(recording.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(recording.error().message, HasSubstr(folder.File("a.mp4") + ": " + c.complaint));
  }
}

}  // namespace
}  // namespace camgyro
