#include "tools/simulation/scenario.h"

#include <gmock/gmock.h>

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

}  // namespace
}  // namespace camgyro::simulation
