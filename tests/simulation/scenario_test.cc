#include "simulation/scenario.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <set>
#include <string>

#include "simulation/simulate.h"
#include "tests/paths.h"

namespace camgyro::simulation {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string ComplaintOf(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
  const auto scenario = ParseScenario(yaml, overrides);
  return scenario ? "" : scenario.error().message;
}

TEST(Scenario, ReadsWhatIsThereAndKeepsTheRest) {
  const Scenario scenario = ParseScenario(R"(
seed: 7
motion: {kind: running, speed_m_s: 2.5}
camera: {resolution: [640, 480], focal_px: 500, readout_s: -0.01}
mount: {q_gyro_cam_wxyz: [0, 1, 0, 0]}
effects:
  radial_distortion: {model: kb4, k1: -0.01}
  gyro_scale: {error: [0.01, 0.02, 0.03]}
)")
                                .value();
  EXPECT_EQ(scenario.seed, 7u);
  EXPECT_EQ(scenario.motion.kind, MotionKind::kRunning);
  EXPECT_EQ(scenario.motion.speed_m_s, 2.5);  // wins over the preset
  EXPECT_EQ(scenario.motion.step_hz, MotionPreset(MotionKind::kRunning).step_hz);
  EXPECT_EQ(scenario.camera.width_px, 640);
  EXPECT_EQ(scenario.camera.readout_s, -0.01);
  EXPECT_EQ(scenario.camera.rate_hz, CameraOptions().rate_hz);
  EXPECT_EQ(scenario.mount.q_gyro_cam.x(), 1.0);
  EXPECT_THAT(ActiveEffects(scenario.effects), ElementsAre("radial_distortion", "gyro_scale"));
}

TEST(Scenario, EmptyFileIsTheDefault) {
  EXPECT_TRUE(ParseScenario(""));
  EXPECT_TRUE(ParseScenario("camera:\n"));
}

TEST(Scenario, UnknownKeysSuggestTheNearest) {
  EXPECT_EQ(ComplaintOf("seed: 1\ncamera: {focal: 3}"),
            "line 2: camera.focal: unknown key; did you mean focal_px?");
  EXPECT_EQ(ComplaintOf("effects: {gyro_scaling: {}}"),
            "line 1: effects.gyro_scaling: unknown key; did you mean gyro_scale?");
  EXPECT_EQ(ComplaintOf("motion: {kind: walk}"),
            "line 1: motion.kind: is \"walk\"; did you mean walking?");
  EXPECT_THAT(ComplaintOf("qqqqqq: 1"), HasSubstr("known are seed, duration_s"));
}

TEST(Scenario, WrongValuesAreNamed) {
  EXPECT_THAT(ComplaintOf("camera: {focal_px: -1}"),
              HasSubstr("camera.focal_px: must be positive"));
  EXPECT_THAT(ComplaintOf("camera: {focal_px: .nan}"), HasSubstr("finite"));
  EXPECT_THAT(ComplaintOf("camera: {focal_px: wide}"), HasSubstr("wrong type"));
  EXPECT_THAT(ComplaintOf("camera: 3"), HasSubstr("camera: must be a mapping"));
  EXPECT_THAT(ComplaintOf("scene: {depth_m: [1]}"), HasSubstr("list of 2 numbers"));
  EXPECT_THAT(ComplaintOf("scene: {depth_m: [9, 1]}"), HasSubstr("[nearest, farthest]"));
  EXPECT_THAT(ComplaintOf("mount: {q_gyro_cam_wxyz: [1, 1, 0, 0]}"), HasSubstr("norm 1"));
  EXPECT_THAT(ComplaintOf("video: {format: mp4}"), HasSubstr("no surface"));
  EXPECT_THAT(ComplaintOf("motion: {kind: file}"), HasSubstr("motion.file"));
  EXPECT_THAT(ComplaintOf("effects: {readout_nonlinear: {curve: 0.3}}"), HasSubstr("0.25"));
  EXPECT_THAT(ComplaintOf("effects: {attitude_rolling_shutter: {roll_by_yaw_s: 0.01}}"),
              HasSubstr("walk_rad is missing"));
  EXPECT_THAT(ComplaintOf("attitudes: {noise_rad: 0.001}\nscene: {kind: room}\n"
                          "video: {format: mp4}"),
              HasSubstr("leave video.format out"));
  EXPECT_THAT(ComplaintOf("camera: {"), HasSubstr("line "));
}

TEST(Scenario, OverridesWinAndAreChecked) {
  const Scenario scenario =
      ParseScenario("camera: {focal_px: 500}", {"camera.focal_px=600", "effects.clock_skew.ppm=300",
                                                "motion.rotation_rms_rad_s=[1, 2, 3]"})
          .value();
  EXPECT_EQ(scenario.camera.focal_px, 600.0);
  EXPECT_EQ(scenario.effects.clock_skew.ppm, 300.0);
  EXPECT_EQ(scenario.motion.rotation_rms_rad_s, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(ComplaintOf("", {"camera.focus_px=600"}), HasSubstr("did you mean focal_px?"));
  EXPECT_THAT(ComplaintOf("", {"camera.focal_px"}), HasSubstr("key=value"));
  EXPECT_THAT(ComplaintOf("seed: 1", {"seed.x=1"}), HasSubstr("seed"));
}

TEST(Scenario, MissingFileIsNamed) {
  EXPECT_THAT(LoadScenario("/nowhere.yaml").error().message, HasSubstr("/nowhere.yaml"));
}

std::string ScenarioFolder() { return SourceDir() + "/tools/scenarios"; }

TEST(ScenarioFiles, AllLoadAndEffectsAreTheOnesOfTheirName) {
  std::set<std::string> shown;
  for (const auto& entry : std::filesystem::directory_iterator(ScenarioFolder())) {
    SCOPED_TRACE(entry.path().string());
    const auto scenario = LoadScenario(entry.path().string());
    ASSERT_TRUE(scenario) << scenario.error().message;
    const std::string name = entry.path().stem().string();
    if (name.rfind("effect_", 0) == 0) {
      // effect_NAME or effect_NAME.VARIANT
      EXPECT_THAT(ActiveEffects(scenario->effects),
                  ElementsAre(name.substr(7, name.find('.') - 7)));
      shown.insert(name.substr(7, name.find('.') - 7));
    }
    const auto sensors = SimulateSensors(*scenario);  // the camera stays in its scene
    EXPECT_TRUE(sensors) << sensors.error().message;
  }
  Effects().ForEach([&](const auto& effect) { EXPECT_EQ(shown.count(effect.kName), 1u); });
}

// default.yaml names every key with its default. That none is missing or stale shows in the
// tracks: all options together give what no option gives.
TEST(ScenarioFiles, DefaultIsTheDefault) {
  const Scenario file = LoadScenario(ScenarioFolder() + "/default.yaml").value();
  const Simulated a = SimulateTracks(file).value(), b = SimulateTracks(Scenario()).value();
  ASSERT_EQ(a.recording.tracks.size(), b.recording.tracks.size());
  for (size_t i = 0; i < a.recording.tracks.size(); ++i) {
    ASSERT_EQ(a.recording.tracks[i].size(), b.recording.tracks[i].size());
    for (size_t k = 0; k < a.recording.tracks[i].size(); ++k) {
      EXPECT_LT((a.recording.tracks[i][k].px - b.recording.tracks[i][k].px).norm(), 1e-9);
    }
  }
  ASSERT_EQ(a.recording.gyro.size(), b.recording.gyro.size());
  for (size_t i = 0; i < a.recording.gyro.size(); ++i) {
    const auto difference =
        a.recording.gyro[i].omega_gyro_rad_s - b.recording.gyro[i].omega_gyro_rad_s;
    EXPECT_LT(difference.norm(), 1e-7);  // the file rounds the mounting
  }
  EXPECT_EQ(file.video.crf, VideoOptions().crf);
  EXPECT_EQ(file.video.full_well_electrons, VideoOptions().full_well_electrons);
  EXPECT_EQ(file.scene.far_m, SceneOptions().far_m);
}

}  // namespace
}  // namespace camgyro::simulation
