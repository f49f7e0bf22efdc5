#include "estimator/diagnosis/data_faults.h"

#include <gmock/gmock.h>

#include "core/saturation.h"
#include "tests/estimator/diagnosis/simulated_recording.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

std::vector<std::string> Names(const std::vector<DataFault>& faults) {
  std::vector<std::string> names;
  for (const DataFault& fault : faults) names.push_back(fault.name);
  return names;
}

TEST(DataFaults, NoneInSoundData) {
  for (const char* motion : {"motion.kind=walking", "motion.kind=running", "motion.kind=slow"}) {
    EXPECT_THAT(Names(FindDataFaults(SimulateFor12S({motion}).recording)), testing::IsEmpty())
        << motion;
  }
}

TEST(DataFaults, Saturation) {
  const auto simulated =
      SimulateFor12S({"motion.kind=running", "effects.gyro_saturation={limit_rad_s: 2.0}"});
  const auto faults = FindDataFaults(simulated.recording);
  ASSERT_THAT(Names(faults), testing::ElementsAre("gyro_saturation"));
  EXPECT_THAT(faults[0].finding, HasSubstr("2.000 rad/s"));
  int clipped = 0, marked = 0;
  const std::vector<bool> saturated = FindSaturated(simulated.recording.gyro);
  for (size_t i = 0; i < saturated.size(); ++i) {
    clipped += simulated.recording.gyro[i].omega_gyro_rad_s.cwiseAbs().maxCoeff() >= 2.0 ? 1 : 0;
    marked += saturated[i] ? 1 : 0;
  }
  EXPECT_GT(marked, 10);
  EXPECT_EQ(marked, clipped);
}

TEST(DataFaults, AnAxisThatIsConstant) {
  Recording recording = SimulateFor12S({"motion.kind=walking"}).recording;
  for (GyroSample& sample : recording.gyro) sample.omega_gyro_rad_s.y() = 0.25;
  const std::vector<DataFault> faults = FindDataFaults(recording);
  ASSERT_THAT(Names(faults), testing::ElementsAre("gyro_axis_constant"));
  EXPECT_THAT(faults[0].finding, HasSubstr("rates about y have the same value"));
  EXPECT_EQ(faults[0].count, 1);
}

TEST(DataFaults, DroppedFramesAndSamples) {
  Recording recording = SimulateFor12S({}).recording;
  recording.frames.erase(recording.frames.begin() + 100, recording.frames.begin() + 103);
  recording.tracks.erase(recording.tracks.begin() + 100, recording.tracks.begin() + 103);
  recording.gyro.erase(recording.gyro.begin() + 500, recording.gyro.begin() + 520);
  const auto faults = FindDataFaults(recording);
  ASSERT_THAT(Names(faults), testing::ElementsAre("dropped_frames", "dropped_samples"));
  EXPECT_THAT(faults[0].finding, HasSubstr("about 3 frames missing"));
  EXPECT_THAT(faults[1].finding, HasSubstr("105 ms"));
}

// A frame that comes late leaves a gap before it, and none in what was recorded; nor do frames that
// wait for it and come close after it. Where one is missing beside, the gap is longer.
TEST(DataFaults, LateFramesAreNoGaps) {
  Recording recording = SimulateFor12S({}).recording;
  recording.frames[50].stamp_ns += 28000000;
  for (const size_t i : {80U, 81U}) {
    recording.frames[i].stamp_ns =
        recording.frames[82].stamp_ns - 1000000 * (90 - static_cast<int64_t>(i));
  }
  EXPECT_THAT(FindDataFaults(recording), testing::IsEmpty());
  recording.frames.erase(recording.frames.begin() + 49);
  recording.tracks.erase(recording.tracks.begin() + 49);
  const auto faults = FindDataFaults(recording);
  ASSERT_THAT(Names(faults), testing::ElementsAre("dropped_frames"));
  EXPECT_THAT(faults[0].finding,
              HasSubstr("1 gaps in the frames' stamps (about 1 frames missing)"));
}

// Every fifth picture is shown twice, with the stamp of the one that is missing.
TEST(DataFaults, RepeatedPicturesAreLeftOut) {
  const Recording sound = SimulateFor12S({"motion.kind=running"}).recording;
  Recording recording = sound;
  int repeats = 0;
  for (size_t i = 5; i + 1 < recording.tracks.size(); i += 5) {
    recording.tracks[i] = recording.tracks[i - 1];
    ++repeats;
  }
  Recording with_matches = recording;
  with_matches.matches = PairsFromTracks(recording.tracks, 1);
  with_matches.tracks.clear();
  const int dropped = DropRepeatedPictures(&recording);
  EXPECT_GT(dropped, 0.9 * repeats);  // a few lie where the camera is hardly moving
  EXPECT_EQ(recording.frames.size(), sound.frames.size() - static_cast<size_t>(dropped));
  EXPECT_EQ(recording.tracks.size(), recording.frames.size());
  ASSERT_EQ(recording.faults.size(), 1u);
  EXPECT_EQ(recording.faults[0].name, "duplicated_frames");
  EXPECT_EQ(recording.faults[0].count, dropped);
  for (size_t i = 1; i < recording.frames.size(); ++i) {  // each picture has its own stamp again
    const auto of = std::find_if(sound.frames.begin(), sound.frames.end(), [&](const Frame& f) {
      return f.stamp_ns == recording.frames[i].stamp_ns;
    });
    ASSERT_NE(of, sound.frames.end());
  }
  EXPECT_EQ(DropRepeatedPictures(&with_matches), dropped);
  ASSERT_EQ(with_matches.frames.size(), recording.frames.size());
  for (const FramePair& pair : with_matches.matches) {
    EXPECT_EQ(pair.frame_b, pair.frame_a + 1);
    const Match& match = pair.matches.front();
    const auto& points = recording.tracks[static_cast<size_t>(pair.frame_b)];
    EXPECT_TRUE(std::any_of(points.begin(), points.end(),
                            [&](const TrackedPoint& p) { return p.px == match.px_b; }));
  }

  Recording untouched = sound;
  EXPECT_EQ(DropRepeatedPictures(&untouched), 0);
  EXPECT_EQ(untouched.frames.size(), sound.frames.size());
  EXPECT_TRUE(untouched.faults.empty());
}

// A stream that hangs for a quarter of a second, while the camera turns on.
TEST(DataFaults, AFrozenPictureIsLeftOut) {
  Recording recording = SimulateFor12S({"motion.kind=running"}).recording;
  const size_t all = recording.frames.size();
  for (size_t i = 60; i < 67; ++i) recording.tracks[i] = recording.tracks[59];
  EXPECT_EQ(DropRepeatedPictures(&recording), 7);
  ASSERT_EQ(recording.frames.size(), all - 7);
  EXPECT_EQ(recording.PictureOf(59), 59u);
  EXPECT_EQ(recording.PictureOf(60), 67u);
  EXPECT_TRUE(FindDataFaults(recording).empty());  // the gap is one of our making
}

TEST(DataFaults, DuplicatedFrames) {
  Recording recording = SimulateFor12S({"motion.kind=running"}).recording;
  for (const size_t i : {50u, 120u}) recording.tracks[i] = recording.tracks[i - 1];
  const auto faults = FindDataFaults(recording);
  ASSERT_THAT(Names(faults), testing::ElementsAre("duplicated_frames"));
  EXPECT_THAT(faults[0].finding, HasSubstr("2 frames"));
}

TEST(DataFaults, ARateThatIsNotWhatTheFileClaims) {
  Recording recording = SimulateFor12S({}).recording;
  recording.gyro_info.declared_rate_hz = 100.0;
  const auto faults = FindDataFaults(recording);
  ASSERT_THAT(Names(faults), testing::ElementsAre("gyro_rate"));
  EXPECT_THAT(faults[0].finding, testing::AllOf(HasSubstr("100 Hz"), HasSubstr("200 Hz")));
}

}  // namespace
}  // namespace camgyro
