// `camgyro stabilize` on a rendered rolling-shutter video, and the sound of a video.
#include <gmock/gmock.h>

#include <opencv2/core.hpp>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "frontend/readers/video_container.h"
#include "tests/tools/run_camgyro.h"
#include "tools/stabilization/video_writer.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Turns only, in a textured room: f 290 px, t_r 20 ms, t_d 15 ms.
constexpr char kTurning[] = R"(
duration_s: 1
seed: 5
motion: {kind: rotation}
scene: {kind: room}
camera: {resolution: [320, 240], focal_px: 290, exposure_s: 0.002}
video: {format: mp4, max_blur_samples: 4, crf: 10}
)";

// The numbers of a row of the summary.
std::vector<double> NumbersOf(const std::string& out, const std::string& name) {
  std::vector<double> numbers;
  std::stringstream rest(out.substr(out.find(name) + name.size()));
  double number;
  std::string unit;
  while (numbers.size() < 3 && rest >> number >> unit) numbers.push_back(number);
  return numbers;
}

class StabilizeCommandTest : public CamgyroTest {
 protected:
  static Result<Recording> Read(const std::string& file) { return ReadRecording(file); }
};

TEST_F(StabilizeCommandTest, FramesLieOnEachOtherOnlyWithTheCalibration) {
  Simulate(kTurning, "a");
  const RunResult run = Run("stabilize a --calibration=a/truth.yaml --out=b/out.mp4");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto turned = NumbersOf(run.out, "each turned by the gyro"),
             bent = NumbersOf(run.out, "homography");
  ASSERT_EQ(turned.size(), 3u) << run.out;
  ASSERT_EQ(bent.size(), 3u) << run.out;
  EXPECT_GT(turned[0], 20.0 * turned[2]) << run.out;  // as recorded
  EXPECT_GT(turned[1], 4.0 * turned[2]) << run.out;   // t_d = t_r = 0
  EXPECT_GT(bent[0], 1.3 * bent[2]) << run.out;

  EXPECT_THAT(run.out, Not(HasSubstr("borders show")));
  EXPECT_THAT(Run("stabilize a --calibration=a/truth.yaml --out=b/out.mp4 --border=black").out,
              HasSubstr("borders show in"));

  // A delay that is 10 ms off shows.
  std::string yaml = ReadFile(Path("a/truth.yaml"));
  const size_t at = yaml.find("0.015");
  ASSERT_NE(at, std::string::npos) << yaml;
  std::ofstream(Path("wrong.yaml")) << yaml.replace(at, 5, "0.025");
  const RunResult wrong = Run("stabilize a --calibration=wrong.yaml --out=b/wrong.mp4");
  ASSERT_EQ(wrong.exit_code, 0) << wrong.err;
  EXPECT_GT(NumbersOf(wrong.out, "each turned by the gyro")[2], 3.0 * turned[2]);
}

TEST_F(StabilizeCommandTest, WritesAVideoOfTheSameFrames) {
  Simulate(kTurning, "a");
  const auto source = ReadVideoContainer(Path("a/cam0/video.mp4"));
  ASSERT_TRUE(source);
  ASSERT_EQ(Run("stabilize a --calibration=a/truth.yaml --out=out.mp4 --side_by_side --zoom=1.25")
                .exit_code,
            0);
  const auto out = ReadVideoContainer(Path("out.mp4"));
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(out->width_px, 640);
  EXPECT_EQ(out->height_px, 240);
  ASSERT_EQ(out->stamps_ns.size(), source->stamps_ns.size());
  for (size_t i = 0; i < out->stamps_ns.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(out->stamps_ns[i]), static_cast<double>(source->stamps_ns[i]),
                2e4);  // two ticks of 90 kHz
  }
  // The left half is the source, but for the coding.
  const auto decode = [](const std::string& video, int width) {
    Recording recording;
    recording.video_file = video;
    recording.camera.width_px = width;
    recording.camera.height_px = 240;
    recording.frames.resize(31);
    cv::Mat picture;
    auto frames = OpenFrames(recording);
    EXPECT_TRUE(frames && (*frames)->Next(&picture).value_or(false));
    return picture;
  };
  const cv::Mat both = decode(Path("out.mp4"), 640);
  const cv::Mat recorded = decode(Path("a/cam0/video.mp4"), 320);
  EXPECT_LT(cv::norm(both.colRange(0, 320), recorded, cv::NORM_L1) / (320.0 * 240.0), 3.0);
  EXPECT_GT(cv::norm(both.colRange(320, 640), recorded, cv::NORM_L1) / (320.0 * 240.0), 6.0);
  // Nothing else is left behind.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(Path("")), {}), 4);  // a, out, 2 logs
}

TEST_F(StabilizeCommandTest, RefusesWhatCannotBe) {
  Simulate(kTurning, "a");
  const auto expect = [&](const std::string& arguments, int code, const std::string& message) {
    const RunResult run = Run("stabilize " + arguments);
    EXPECT_EQ(run.exit_code, code) << arguments;
    EXPECT_THAT(run.err, HasSubstr(message));
  };
  expect("a --out=b.mp4", 2, "--calibration=FILE is needed");
  expect("a --calibration=a/truth.yaml --out=b.avi", 2, "expected the name of a video");
  expect("a --calibration=a/truth.yaml --out=b.mp4 --border=grey", 2,
         "avoid, black, stretch or mirror");
  expect("a --calibration=a/truth.yaml --out=a/cam0/video.mp4", 2, "the recording's own video");
  expect("a --calibration=none.yaml --out=b.mp4", 3, "none.yaml");
  std::string yaml = ReadFile(Path("a/truth.yaml"));
  std::ofstream(Path("late.yaml")) << std::string(yaml).replace(yaml.find("0.015"), 5, "1e3  ");
  expect("a --calibration=late.yaml --out=b.mp4", 3, "no two frames lie within the gyro's time");
  std::ofstream(Path("size.yaml"))
      << std::string(yaml).replace(yaml.find("320, 240"), 8, "640, 480");
  expect("a --calibration=size.yaml --out=b.mp4", 3, "expected 640 x 480");
  EXPECT_FALSE(Exists("b.mp4"));
  for (const auto& entry : std::filesystem::directory_iterator(Path(""))) {
    EXPECT_THAT(entry.path().string(), Not(HasSubstr(".tmp")));
  }
}

struct Packet {
  double time_s;
  std::string bytes;
};

// The sound packets of a file.
std::vector<Packet> SoundOf(const std::string& file) {
  std::vector<Packet> packets;
  auto format = OpenContainer(file);
  EXPECT_TRUE(format);
  const FfmpegPtr<AVPacket> packet(av_packet_alloc());
  while (av_read_frame(format->get(), packet.get()) >= 0) {
    const AVStream& stream = *(*format)->streams[packet->stream_index];
    if (stream.codecpar->codec_type == AVMEDIA_TYPE_AUDIO) {
      packets.push_back({static_cast<double>(packet->pts) * av_q2d(stream.time_base),
                         std::string(packet->data, packet->data + packet->size)});
    }
    av_packet_unref(packet.get());
  }
  return packets;
}

// An MP4 with pictures of nothing and 1 s of what claims to be AAC sound.
void WriteSoundingVideo(const std::string& file) {
  AVFormatContext* out = nullptr;
  ASSERT_GE(avformat_alloc_output_context2(&out, nullptr, "mp4", file.c_str()), 0);
  AVStream* sound = avformat_new_stream(out, nullptr);
  sound->codecpar->codec_type = AVMEDIA_TYPE_AUDIO;
  sound->codecpar->codec_id = AV_CODEC_ID_AAC;
  sound->codecpar->sample_rate = 44100;
  sound->codecpar->frame_size = 1024;
  sound->codecpar->ch_layout = AV_CHANNEL_LAYOUT_STEREO;
  sound->codecpar->extradata = static_cast<uint8_t*>(av_mallocz(AV_INPUT_BUFFER_PADDING_SIZE + 2));
  sound->codecpar->extradata[0] = 0x12;  // AAC-LC, 44.1 kHz, two channels
  sound->codecpar->extradata[1] = 0x10;
  sound->codecpar->extradata_size = 2;
  sound->time_base = {1, 44100};
  ASSERT_GE(avio_open(&out->pb, file.c_str(), AVIO_FLAG_WRITE), 0);
  ASSERT_GE(avformat_write_header(out, nullptr), 0);
  const FfmpegPtr<AVPacket> packet(av_packet_alloc());
  for (int i = 0; i < 43; ++i) {
    ASSERT_GE(av_new_packet(packet.get(), 20 + i), 0);
    std::fill_n(packet->data, packet->size, static_cast<uint8_t>(i));
    packet->pts = packet->dts = 1024 * i;
    packet->duration = 1024;
    packet->flags |= AV_PKT_FLAG_KEY;
    ASSERT_GE(av_interleaved_write_frame(out, packet.get()), 0);
  }
  ASSERT_GE(av_write_trailer(out), 0);
  avio_closep(&out->pb);
  avformat_free_context(out);
}

TEST_F(StabilizeCommandTest, KeepsTheSoundInTime) {
  WriteSoundingVideo(Path("sound.mp4"));
  const std::vector<Packet> before = SoundOf(Path("sound.mp4"));
  ASSERT_EQ(before.size(), 43u);
  VideoWriterOptions options;
  options.width_px = 64;
  options.height_px = 48;
  options.source_file = Path("sound.mp4");
  options.source_start_s = 0.2;
  auto writer = VideoWriter::Open(Path("out.mp4"), "mp4", options);
  ASSERT_TRUE(writer) << writer.error().message;
  EXPECT_EQ((*writer)->sound(), "copied");
  for (int i = 0; i <= 15; ++i) {
    ASSERT_TRUE((*writer)->Write(cv::Mat(72, 64, CV_8UC1, cv::Scalar(100 + i)), i * 33333333LL));
  }
  ASSERT_TRUE((*writer)->Close());
  const std::vector<Packet> after = SoundOf(Path("out.mp4"));
  // Those between 0.2 s and the last picture, 0.5 s later, byte by byte.
  const auto first =
      std::find_if(before.begin(), before.end(), [](const Packet& p) { return p.time_s >= 0.2; });
  ASSERT_GE(after.size(), 20u);
  for (size_t i = 0; i < after.size(); ++i) {
    const Packet& expected = *(first + static_cast<std::ptrdiff_t>(i));
    EXPECT_EQ(after[i].bytes, expected.bytes) << i;
    EXPECT_NEAR(after[i].time_s, expected.time_s - 0.2, 1e-3) << i;
  }
  EXPECT_NEAR(after.back().time_s, 0.5, 0.03);
}

TEST(VideoWriter, NamesAFileThatCannotBeWritten) {
  VideoWriterOptions options;
  options.width_px = 64;
  options.height_px = 48;
  const auto writer = VideoWriter::Open("/no/such/folder/a.mp4", "mp4", options);
  ASSERT_FALSE(writer);
  EXPECT_THAT(writer.error().message,
              AllOf(HasSubstr("/no/such/folder/a.mp4"), HasSubstr("written")));
}

}  // namespace
}  // namespace camgyro
