// Recordings with faults, calibrated as if they had none: the sample, whose truth is known, with
// pictures and stamps as loggers spoil them.
#include "pipeline/run.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "pipeline/read_calibration.h"
#include "simulation/simulate.h"
#include "tests/estimator/simulated_input.h"
#include "tests/paths.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::Field;

namespace fs = std::filesystem;

class FaultyRecording : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("camgyro_run_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "cam0/data");
    fs::copy(sample_ / "imu0", folder_ / "imu0");
    fs::copy_file(sample_ / "cam0/sensor.yaml", folder_ / "cam0/sensor.yaml");
  }
  void TearDown() override { fs::remove_all(folder_); }

  // data.csv for these stamps, with the names of pictures if they have any.
  void WriteFrames(const std::vector<Frame>& frames) const {
    std::ofstream table(folder_ / "cam0/data.csv");
    for (const Frame& frame : frames) table << frame.stamp_ns << "," << frame.image_file << "\n";
  }

  Recording Sample() const {
    Result<Recording> recording = ReadRecording(sample_.string());
    EXPECT_TRUE(recording);
    return *recording;
  }

  // Calibrates the folder. Focal length, readout time and delay have to be determined, and within
  // three sigmas.
  std::vector<RecordedFault> Calibrate() const {
    Result<Recording> recording = ReadRecording(folder_.string());
    if (!recording) {
      ADD_FAILURE() << recording.error().message;
      return {};
    }
    const auto run =
        RunCalibration({}, OnlineEstimator::kWindow, DeviceClass::kPhone, nullptr, &*recording);
    if (!run) {
      ADD_FAILURE() << run.error().message;
      return {};
    }
    const Result<Calibration> truth = ReadCalibration((sample_ / "truth.yaml").string());
    EXPECT_TRUE(truth);
    const Calibration& found = run->report.calibration;
    const StateVector errors = Difference(found, *truth).cwiseQuotient(found.sigma());
    for (const int i : {kStateFocal, kStateReadout, kStateDelay}) {
      EXPECT_LT(std::abs(errors[i]), 3.0) << i;
      EXPECT_TRUE(found.determined.at(static_cast<size_t>(i))) << i;
    }
    return recording->faults;
  }

  const fs::path sample_ = fs::path(SourceDir()) / "tools/sample";
  fs::path folder_;
};

auto Fault(const char* name, int count) {
  return AllOf(Field(&RecordedFault::name, name), Field(&RecordedFault::count, count));
}

// Every fifth picture is the one before; the lens is covered for 20 frames, and three pictures have
// another size.
TEST_F(FaultyRecording, PicturesThatAreNone) {
  const Recording sample = Sample();
  auto source = OpenFrames(sample);
  ASSERT_TRUE(source) << source.error().message;
  std::vector<Frame> frames = sample.frames;
  cv::Mat gray, shown;
  for (size_t i = 0; i < frames.size(); ++i) {
    ASSERT_TRUE((*source)->Next(&gray).value_or(false));
    if (i % 5 != 4) shown = gray.clone();
    cv::Mat picture = shown;
    if (i >= 100 && i < 120) picture = cv::Mat(gray.size(), CV_8UC1, cv::Scalar(16));
    if (i == 50 || i == 51 || i == 180) cv::resize(shown, picture, cv::Size(320, 240));
    frames[i].image_file = std::to_string(i) + ".png";
    ASSERT_TRUE(cv::imwrite((folder_ / "cam0/data" / frames[i].image_file).string(), picture,
                            {cv::IMWRITE_PNG_COMPRESSION, 1}));
  }
  WriteFrames(frames);
  const std::vector<RecordedFault> faults = Calibrate();
  // Of 54 repeated pictures, 4 are covered; of others, the camera hardly moves around some.
  ASSERT_EQ(faults.size(), 3u);
  EXPECT_THAT(faults[0], Fault("frames_of_another_size", 3));
  EXPECT_THAT(faults[1], Fault("frames_without_contrast", 20));
  EXPECT_EQ(faults[2].name, "duplicated_frames");
  EXPECT_GT(faults[2].count, 45);
  EXPECT_LE(faults[2].count, 50);
}

TEST_F(FaultyRecording, FrameStampsOutOfOrder) {
  std::vector<Frame> frames = Sample().frames;
  frames[50].stamp_ns = frames[49].stamp_ns;
  frames[120].stamp_ns -= 90'000'000;
  frames[200].stamp_ns += 1'000'000'000;
  WriteFrames(frames);
  fs::create_symlink(sample_ / "cam0/video.mp4", folder_ / "cam0/video.mp4");
  EXPECT_THAT(Calibrate(), ElementsAre(Fault("frame_stamps_step_back", 3)));
}

// A file of tracks does not say how they were made, so that they are asked.
TEST(EnsureImageMotion, FindsTracksWhoseErrorsAddUp) {
  simulation::Scenario scenario;
  scenario.duration_s = 8.0;
  scenario.tracks.noise_px = 0.1;
  for (const bool reanchored : {false, true}) {
    scenario.tracks.reanchored = reanchored;
    Recording recording = simulation::SimulateTracks(scenario)->recording;
    recording.match_noise = MatchNoise::kBothImages;
    const auto summary = EnsureImageMotion(nullptr, &recording);
    ASSERT_TRUE(summary.has_value()) << summary.error().message;
    EXPECT_EQ(summary->noise_adds_up, reanchored);
    EXPECT_EQ(recording.match_noise,
              reanchored ? MatchNoise::kSecondImage : MatchNoise::kBothImages);
  }
}

// Rooms through a lens that nothing declares. The fit began without it: f was 582 ± 40 px and 486.8
// ± 5.5 px, at 458.
TEST(RunCalibration, BeginsWithTheLensThatTheMatchesShow) {
  for (const uint64_t seed : {2, 4}) {
    simulation::Scenario scenario = RoomThroughALens();
    scenario.seed = seed;
    auto s = simulation::SimulateTracks(scenario);
    ASSERT_TRUE(s);
    const auto run =
        RunCalibration({}, OnlineEstimator::kWindow, DeviceClass::kPhone, nullptr, &s->recording);
    ASSERT_TRUE(run) << run.error().message;
    const CalibrationReport& report = run->report;
    EXPECT_THAT(report.doubts, testing::IsEmpty()) << seed;
    EXPECT_THAT(report.notes, testing::Contains(testing::HasSubstr("the matches alone show it")));
    EXPECT_GT(report.start.explained, 0.97);
    ASSERT_TRUE(report.start.focal && report.start.focal->determined);
    ASSERT_TRUE(report.calibration.sigma_total());
    const StateVector error = Difference(report.calibration, s->truth);
    EXPECT_LT(error.cwiseQuotient(*report.calibration.sigma_total()).cwiseAbs().maxCoeff(), 3.5);
    EXPECT_LT((*report.calibration.sigma_total())[kStateFocal], 6.0);
  }
}

// A left-handed gyro is mended where it stands, so that whatever looks at the recording afterwards
// (the total of the sigmas, the report) sees what the calibration has seen.
TEST(RunDiagnosis, MendsTheGyroForAllThatFollows) {
  simulation::Scenario scenario;
  scenario.duration_s = 12.0;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
  const auto simulated = simulation::SimulateTracks(scenario, 1);
  ASSERT_TRUE(simulated);
  Recording exchanged = simulated->recording;
  for (GyroSample& sample : exchanged.gyro) {
    std::swap(sample.omega_gyro_rad_s.x(), sample.omega_gyro_rad_s.y());
  }
  const Eigen::Vector3d before_rad_s = exchanged.gyro[100].omega_gyro_rad_s;
  const auto run = RunDiagnosis({}, DeviceClass::kPhone, nullptr, &exchanged);
  ASSERT_TRUE(run) << run.error().message;
  const Diagnosis& diagnosis = run->diagnosis;
  ASSERT_THAT(diagnosis.faults, testing::Contains(Field(&DataFault::name, "gyro_axes")));
  EXPECT_EQ(exchanged.gyro[100].omega_gyro_rad_s, -before_rad_s);
  const Calibration& found = diagnosis.result().calibration;
  const StateVector error = Difference(found, simulated->truth);
  ASSERT_TRUE(found.sigma_total());
  EXPECT_LT(std::abs(error[kStateFocal]), 3.0 * (*found.sigma_total())[kStateFocal]);
  // With the gyro as it was, the lens could be anything: 40 px.
  EXPECT_LT((*found.sigma_total())[kStateFocal], 0.01 * simulated->truth.lens[kFocal]);
}

}  // namespace
}  // namespace camgyro
