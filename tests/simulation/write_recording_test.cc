#include "simulation/write_recording.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <sstream>
#include <vector>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "simulation/render.h"
#include "simulation/trajectory.h"
#include "tests/paths.h"
#include "tools/simulate_command.h"

namespace camgyro::simulation {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr char kTracks[] = R"(
duration_s: 1
camera: {readout_s: 0.03, exposure_s: 0.004, exposure_swing: 0.2}
effects: {gyro_scale: {error: [0.01, 0, 0]}, delay_wander: {amplitude_s: 0.003}}
)";
constexpr char kVideo[] = R"(
duration_s: 0.3
scene: {kind: room}
motion: {path_radius_m: 1}
camera: {resolution: [160, 120], focal_px: 130}
video: {format: mp4}
)";

class WriteRecordingTest : public testing::Test {
 protected:
  void SetUp() override {
    // One folder per test: ctest runs them at the same time.
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::path(testing::TempDir()) / (std::string("camgyro_write_") + test->name());
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  std::string Folder(const std::string& name) const { return (root_ / name).string(); }

  std::string ScenarioFile(const std::string& yaml) const {
    const std::string path = Folder("scenario.yaml");
    std::ofstream(path) << yaml;
    return path;
  }

  static std::string Content(const fs::path& file) {
    std::stringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
  }
  static std::map<std::string, std::string> Contents(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      files[fs::relative(entry.path(), folder).string()] = Content(entry.path());
    }
    return files;
  }

  fs::path root_;
};

TEST_F(WriteRecordingTest, ReadsBackAsItWas) {
  const Scenario scenario = ParseScenario(kTracks).value();
  const Simulated s = SimulateTracks(scenario).value();
  ASSERT_TRUE(WriteRecording(s, scenario, Folder("out")));
  const Result<Recording> read = ReadRecording(Folder("out"));
  ASSERT_TRUE(read) << read.error().message;
  const Recording& wrote = s.recording;
  EXPECT_EQ(read->camera.width_px, 720);
  EXPECT_FALSE(read->camera.focal_px);  // a guess that would be the truth is not given away
  EXPECT_FALSE(read->camera.q_gyro_cam);
  ASSERT_EQ(read->frames.size(), wrote.frames.size());
  for (size_t i = 0; i < wrote.frames.size(); ++i) {
    EXPECT_EQ(read->frames[i].stamp_ns, wrote.frames[i].stamp_ns);
    EXPECT_NEAR(read->frames[i].exposure_s, wrote.frames[i].exposure_s, 1e-12);
    ASSERT_EQ(read->tracks[i].size(), wrote.tracks[i].size());
    for (size_t k = 0; k < wrote.tracks[i].size(); ++k) {
      EXPECT_EQ(read->tracks[i][k].track_id, wrote.tracks[i][k].track_id);
      EXPECT_LT((read->tracks[i][k].px - wrote.tracks[i][k].px).norm(), 1e-8);
    }
  }
  ASSERT_EQ(read->gyro.size(), wrote.gyro.size());
  ASSERT_EQ(read->accel.size(), wrote.accel.size());
  for (size_t i = 0; i < wrote.gyro.size(); ++i) {
    EXPECT_EQ(read->gyro[i].stamp_ns, wrote.gyro[i].stamp_ns);
    EXPECT_LT((read->gyro[i].omega_gyro_rad_s - wrote.gyro[i].omega_gyro_rad_s).norm(), 1e-7);
  }
}

TEST_F(WriteRecordingTest, AttitudesReadBackAsTheyWere) {
  const Scenario scenario = ParseScenario("duration_s: 1\nattitudes: {noise_rad: 0.001}").value();
  const Simulated s = SimulateTracks(scenario).value();
  ASSERT_TRUE(WriteRecording(s, scenario, Folder("out")));
  const Result<Recording> read = ReadRecording(Folder("out"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->HasOnlyAttitudes());
  ASSERT_EQ(read->q_cam_world.size(), s.recording.q_cam_world.size());
  for (size_t i = 0; i < s.recording.q_cam_world.size(); ++i) {
    EXPECT_LT(read->q_cam_world[i].angularDistance(s.recording.q_cam_world[i]), 1e-10);
  }
  EXPECT_THAT(Content(Folder("out") + "/truth.yaml"), HasSubstr("noise_rad: 0.001"));
}

TEST_F(WriteRecordingTest, TruthNamesParametersAndEffects) {
  const Scenario scenario = ParseScenario(kTracks).value();
  ASSERT_TRUE(WriteRecording(SimulateTracks(scenario).value(), scenario, Folder("out")));
  const std::string truth = Content(Folder("out") + "/truth.yaml");
  EXPECT_THAT(truth, HasSubstr("focal_px: {value: 650}"));
  EXPECT_THAT(truth, HasSubstr("shutter: {readout_s: {value: 0.03}}"));
  EXPECT_THAT(truth, HasSubstr("- name: gyro_scale\n    parameters:\n"
                               "      - {name: x, unit: 1, value: 0.01}"));
  EXPECT_THAT(truth, HasSubstr("{name: amplitude, unit: s, value: 0.003}"));
  EXPECT_THAT(truth, HasSubstr("noise_px: 1"));
}

// Without tracks in memory they are made while they are written.
TEST_F(WriteRecordingTest, TracksAreTheSameWhetherKeptOrNot) {
  const Scenario scenario = ParseScenario(kTracks).value();
  ASSERT_TRUE(WriteRecording(SimulateTracks(scenario).value(), scenario, Folder("kept")));
  ASSERT_TRUE(WriteRecording(SimulateSensors(scenario).value(), scenario, Folder("made")));
  const auto kept = Contents(Folder("kept"));
  EXPECT_GT(kept.at("cam0/tracks.csv").size(), 10000u);
  EXPECT_TRUE(kept == Contents(Folder("made")));
}

TEST_F(WriteRecordingTest, SameScenarioSameBytes) {
  for (const auto& [yaml, overrides] :
       std::vector<std::pair<std::string, std::vector<std::string>>>{
           {kTracks, {}}, {kVideo, {}}, {kVideo, {"video.format=png", "duration_s=0.1"}}}) {
    const std::string file = ScenarioFile(yaml);
    ASSERT_TRUE(RunSimulate(file, Folder("a"), overrides));
    ASSERT_TRUE(RunSimulate(file, Folder("b"), overrides));
    const auto a = Contents(Folder("a")), b = Contents(Folder("b"));
    EXPECT_GE(a.size(), 7u);
    EXPECT_TRUE(a == b);
    fs::remove_all(Folder("a"));
    fs::remove_all(Folder("b"));
  }
}

TEST_F(WriteRecordingTest, VideoReadsBackAsRendered) {
  const Scenario scenario = ParseScenario(kVideo).value();
  const Simulated s = SimulateSensors(scenario).value();
  ASSERT_TRUE(WriteRecording(s, scenario, Folder("out")));
  const Result<Recording> recording = ReadRecording(Folder("out"));
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 10u);
  auto frames = OpenFrames(*recording);
  ASSERT_TRUE(frames) << frames.error().message;
  Renderer renderer(s, scenario);
  for (size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(recording->frames[i].stamp_ns, s.recording.frames[i].stamp_ns);
    cv::Mat decoded;
    ASSERT_TRUE((*frames)->Next(&decoded).value());
    EXPECT_GT(cv::PSNR(renderer.Render(i), decoded), 33.0);  // H.264 at crf 18
  }
}

// Latencies as long as the interval: frames that waited for one arrive with it, 1 us apart, which
// is less than the video's unit of time.
TEST_F(WriteRecordingTest, VideoOfFramesThatCameTogetherReadsBack) {
  Scenario scenario = ParseScenario(kVideo).value();
  scenario.effects.frame_stamp_jitter.latency_s = 0.03;
  const Simulated s = SimulateSensors(scenario).value();
  const std::vector<Frame>& frames = s.recording.frames;
  EXPECT_TRUE(std::adjacent_find(frames.begin(), frames.end(), [](const Frame& a, const Frame& b) {
                return b.stamp_ns - a.stamp_ns == 1000;
              }) != frames.end());
  const Status written = WriteRecording(s, scenario, Folder("out"));
  ASSERT_TRUE(written) << written.error().message;
  const Result<Recording> recording = ReadRecording(Folder("out"));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->frames.size(), frames.size());
}

TEST_F(WriteRecordingTest, TrajectoryCanBeTheMotionOfAnother) {
  const Scenario scenario = ParseScenario("duration_s: 4").value();
  const Simulated s = SimulateSensors(scenario).value();
  ASSERT_TRUE(WriteRecording(s, scenario, Folder("out")));
  const auto again = ReadTrajectory(Folder("out") + "/truth_trajectory.csv", 1.0 / 30.0,
                                    Eigen::Isometry3d::Identity())
                         .value();
  // Row 30 is 1 s after the first. A cubic spline that smooths with knots every h = 33 ms takes
  // (w h)^2 / 6 from a tone: 4.6 % at the band's upper end of 2.5 Hz, 1 % in its middle.
  const CameraState a = s.frames[30].state, b = again->At(1.0);
  EXPECT_LT(Eigen::AngleAxisd(a.R_world_cam.transpose() * b.R_world_cam).angle(), 2e-3);
  EXPECT_LT((a.omega_cam_rad_s - b.omega_cam_rad_s).norm(), 0.04);
  EXPECT_LT((a.p_world_m - s.frames[0].state.p_world_m - b.p_world_m).norm(), 2e-3);
}

// The trajectory of the gyro frame, from that of the camera at the first row: between two frames
// without rotation and acceleration both move alike, the lever arm apart.
TEST_F(WriteRecordingTest, GyroTrajectoryIsTheCamerasLessTheLeverArm) {
  const Scenario scenario =
      ParseScenario(
          "{duration_s: 1, motion: {kind: rotation, rotation_rms_rad_s: [0, 0, 0], speed_m_s: 1, "
          "heading_deg: 0}, camera: {readout_s: 0.02, delay_s: 0.01}, "
          "mount: {q_gyro_cam_wxyz: [0, 1, 0, 0], p_gyro_cam_m: [0.1, 0.2, 0.3]}}")
          .value();
  ASSERT_TRUE(WriteRecording(SimulateSensors(scenario).value(), scenario, Folder("out")));
  std::ifstream file(Folder("out") + "/truth_trajectory.tum");
  std::string comment;
  std::getline(file, comment);
  double time_s = 0.0, x = 0.0, y = 0.0, z = 0.0;
  ASSERT_TRUE(file >> time_s >> x >> y >> z);
  // The first row is exposed 0.5 s after the first gyro stamp, 1000 s; the camera goes along its
  // own z, the world's y, at 1 m/s. The gyro frame is the camera's turned by pi about x.
  EXPECT_NEAR(time_s, 1000.51, 1e-6);
  EXPECT_NEAR(x, -0.1, 1e-6);
  EXPECT_NEAR(y, 0.51 + 0.3, 1e-6);
  EXPECT_NEAR(z, -0.2, 1e-6);
}

TEST_F(WriteRecordingTest, RefusesWithTheFilesName) {
  EXPECT_THAT(RunSimulate(Folder("none.yaml"), Folder("out")).error().message,
              HasSubstr("none.yaml"));
  const std::string file = ScenarioFile("camera: {focus: 3}");
  EXPECT_THAT(RunSimulate(file, Folder("out")).error().message,
              HasSubstr("scenario.yaml: line 1: camera.focus"));
  std::ofstream(Folder("file")) << "in the way";
  EXPECT_THAT(RunSimulate(ScenarioFile("duration_s: 0.1"), Folder("file")).error().message,
              HasSubstr("file"));
  ASSERT_TRUE(RunSimulate(ScenarioFile("duration_s: 0.1"), Folder("tracks")));
  EXPECT_THAT(RunSimulate(ScenarioFile(kVideo), Folder("tracks")).error().message,
              HasSubstr("tracks.csv: belongs to another recording"));
  EXPECT_THAT(RunSimulate(ScenarioFile(kVideo), Folder("out"), {"camera.resolution=[161, 121]"})
                  .error()
                  .message,
              HasSubstr("even"));
}

// tools/sample is what tools/scenarios/demo.yaml makes; the bytes of its video depend on the
// version of x264.
TEST(Sample, IsWhatItsScenarioMakes) {
  const std::string source = SourceDir();
  const Scenario scenario = LoadScenario(source + "/tools/scenarios/demo.yaml").value();
  const Simulated s = SimulateSensors(scenario).value();
  const Result<Recording> sample = ReadRecording(source + "/tools/sample");
  ASSERT_TRUE(sample) << sample.error().message;
  ASSERT_EQ(sample->gyro.size(), s.recording.gyro.size());
  for (size_t i = 0; i < sample->gyro.size(); ++i) {
    EXPECT_EQ(sample->gyro[i].stamp_ns, s.recording.gyro[i].stamp_ns);
    const auto difference = sample->gyro[i].omega_gyro_rad_s - s.recording.gyro[i].omega_gyro_rad_s;
    EXPECT_LT(difference.norm(), 1e-7);
  }
  auto frames = OpenFrames(*sample);
  ASSERT_TRUE(frames) << frames.error().message;
  Renderer renderer(s, scenario);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(sample->frames[i].stamp_ns, s.recording.frames[i].stamp_ns);
    cv::Mat decoded;
    ASSERT_TRUE((*frames)->Next(&decoded).value());
    EXPECT_GT(cv::PSNR(renderer.Render(i), decoded), 28.0);
  }
}

}  // namespace
}  // namespace camgyro::simulation
