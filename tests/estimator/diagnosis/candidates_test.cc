#include "estimator/diagnosis/candidates.h"

#include <gmock/gmock.h>

#include "core/effects/catalogue.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

// A clock's rate that the start leaves open is a part of the model, and has no name until the fit
// sees it; what the user has asked for has none, whatever its value; what was added has one.
TEST(NameEffects, OfWhatTheDataShow) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(1.0)).value();
  const EffectSetup setup = MakeEffectSetup(s.recording, s.truth);
  const auto with = [&](const std::string& list, const Eigen::VectorXd& values) {
    Calibration c = s.truth;
    c.effects = std::make_shared<const EffectSet>(MakeEffects(list, setup).value());
    c.effect_values = values;
    c.effect_covariance = Eigen::MatrixXd::Identity(values.size(), values.size());
    return c;
  };
  const Calibration begin = with("clock_skew:60,aspect_ratio", Eigen::Vector2d(0.0, 0.0));
  const auto named = [&](const Calibration& fit) {
    std::vector<std::string> names = {"dropped_frames"};
    NameEffects(begin, fit, &names);
    return names;
  };
  const std::string list = "clock_skew:60,aspect_ratio";
  EXPECT_THAT(named(with(list, Eigen::Vector2d(2.9, 50.0))),
              testing::ElementsAre("dropped_frames"));
  EXPECT_THAT(named(with(list, Eigen::Vector2d(-3.1, 0.0))),
              testing::ElementsAre("dropped_frames", "clock_skew"));
  EXPECT_THAT(named(with(list + ",tangential_distortion", Eigen::Vector4d::Zero())),
              testing::ElementsAre("dropped_frames", "tangential_distortion"));
}

}  // namespace
}  // namespace camgyro
