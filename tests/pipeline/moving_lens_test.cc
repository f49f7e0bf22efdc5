#include "pipeline/moving_lens.h"

#include <gmock/gmock.h>

#include <fstream>

#include "core/effects/catalogue.h"
#include "simulation/simulate.h"
#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

class MovingLensTest : public CamgyroTest {
 protected:
  static simulation::Simulated Stabilised() {
    simulation::Scenario scenario;
    scenario.duration_s = 2.0;
    scenario.effects.optical_stabilisation.gain = 0.8;
    scenario.effects.optical_stabilisation.log_hz = 200.0;
    return simulation::SimulateSensors(scenario).value();
  }
  Status Add(const std::string& effects) {
    std::ofstream(Path("calibration.yaml")) << "effects:\n" << effects;
    calibration_.effects.reset();
    s_.recording.video_file = "pictures.mp4";  // that nobody has tracked
    return AddMovingLens(Path("calibration.yaml"), s_.recording, &calibration_);
  }
  simulation::Simulated s_ = Stabilised();
  Calibration calibration_ = s_.truth;
};

TEST_F(MovingLensTest, IsThatOfTheFile) {
  const std::string logged =
      "  - {name: optical_stabilisation, shape: logged/0.001, parameters: [{value: 1.01},\n"
      "     {value: 0}, {value: 0.002}, {value: -0.003}]}\n";
  const Status added = Add("  - {name: aspect_ratio, parameters: [{value: 0.01}]}\n" + logged);
  ASSERT_TRUE(added) << added.error().message;
  ASSERT_EQ(calibration_.effects->items().size(), 1u);
  EXPECT_EQ(calibration_.effects->items().front().shape, "logged/0.001");
  EXPECT_EQ(calibration_.effect_values, Eigen::Vector4d(1.01, 0.0, 0.002, -0.003));
  ASSERT_TRUE(Add("  - {name: aspect_ratio, parameters: [{value: 0.01}]}\n"));
  EXPECT_EQ(calibration_.effects, nullptr);

  const Status few = Add("  - {name: optical_stabilisation, shape: '0.5', parameters: []}\n");
  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message, HasSubstr("has 0 parameters, expected 5"));
  s_.recording.lens_shift.clear();
  const Status lacks = Add(logged);
  ASSERT_FALSE(lacks);
  EXPECT_THAT(lacks.error().message,
              HasSubstr("effects: optical_stabilisation: not of this recording"));
}

TEST_F(MovingLensTest, IsRefusedWhereTheLensIsHeld) {
  ASSERT_TRUE(Add("  - {name: aspect_ratio, parameters: [{value: 0.01}]}\n"));
  EXPECT_TRUE(RefuseStabilisedLens(Path("calibration.yaml")));
  std::ofstream(Path("calibration.yaml")) << "effects: [{name: optical_stabilisation}]\n";
  const Status refused = RefuseStabilisedLens(Path("calibration.yaml"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(refused.error().message, HasSubstr("camgyro rectify takes that out"));
}

}  // namespace
}  // namespace camgyro
