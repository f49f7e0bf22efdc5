// Attitudes instead of pictures: what is wrong with them gets its name, and clean ones get none.
#include <gmock/gmock.h>

#include "estimator/diagnosis/diagnose.h"
#include "estimator/diagnosis/model_check.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

simulation::Scenario Attitudes() {
  simulation::Scenario scenario;
  scenario.duration_s = 30.0;
  scenario.gyro.rate_hz = 100.0;
  scenario.attitudes.walk_rad = 8e-4;
  return scenario;
}

// Delay, bias and mounting, which attitudes tell.
using Errors = Eigen::Matrix<double, 7, 1>;
Errors InSigmas(const Calibration& found, const Calibration& truth) {
  return Difference(found, truth).cwiseQuotient(found.sigma()).tail<7>();
}

TEST(DiagnoseAttitudes, CleanOnesHaveNoEffect) {
  double squares = 0.0;
  for (const uint64_t seed : {1, 2, 3, 4}) {
    auto simulated = simulation::SimulateTracks(Attitudes(), seed);
    ASSERT_TRUE(simulated) << simulated.error().message;
    const Diagnosis diagnosis = Diagnose(nullptr, {}, &simulated->recording);
    EXPECT_THAT(diagnosis.effects, testing::IsEmpty()) << seed;
    EXPECT_FALSE(diagnosis.unexplained_structure) << seed;
    squares += InSigmas(diagnosis.result().calibration, simulated->truth).squaredNorm();
  }
  // 99 % of a chi2 of 28 degrees of freedom, over them, are between 0.45 and 1.82.
  EXPECT_GT(squares / 28.0, 0.45);
  EXPECT_LT(squares / 28.0, 1.82);
}

TEST(DiagnoseAttitudes, NamesThoseOfARollingShutter) {
  simulation::Scenario scenario = Attitudes();
  scenario.effects.attitude_rolling_shutter = {-0.004, 0.003};
  auto simulated = simulation::SimulateTracks(scenario, 3);
  ASSERT_TRUE(simulated) << simulated.error().message;
  const Diagnosis diagnosis = Diagnose(nullptr, {}, &simulated->recording);
  ASSERT_THAT(diagnosis.effects, testing::ElementsAre("attitude_rolling_shutter"));
  EXPECT_FALSE(diagnosis.unexplained_structure);
  const Calibration& found = diagnosis.result().calibration;
  ASSERT_EQ(found.effect_values.size(), 2);
  const Eigen::Vector2d sigma = found.effect_covariance.diagonal().cwiseSqrt();
  EXPECT_NEAR(found.effect_values[0], -0.004, 3.0 * sigma[0]);
  EXPECT_NEAR(found.effect_values[1], 0.003, 3.0 * sigma[1]);
  EXPECT_LT(sigma.maxCoeff(), 3e-4);
  EXPECT_LT(InSigmas(found, simulated->truth).cwiseAbs().maxCoeff(), 3.0);
}

// While running, it looks like a bias about y, which the total of a usual device allows for.
TEST(CalibrateAttitudes, TheTotalKnowsTheirRollingShutter) {
  const auto scenario = simulation::ParseScenario(
      "duration_s: 20\nmotion: {kind: running}\ngyro: {rate_hz: 100}\n"
      "attitudes: {walk_rad: 8e-4}\n"
      "effects: {attitude_rolling_shutter: {roll_by_yaw_s: -0.01, yaw_by_roll_s: 0.01}}",
      {});
  ASSERT_TRUE(scenario) << scenario.error().message;
  const auto simulated = simulation::SimulateTracks(*scenario, 5);
  ASSERT_TRUE(simulated) << simulated.error().message;
  Result<CalibrationReport> report = CalibrateRecording(simulated->recording, nullptr, {});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(CheckModel(simulated->recording, {}, DeviceClass::kPhone, &*report).has_value());
  const Calibration& found = report->calibration;
  ASSERT_TRUE(found.sigma_total().has_value());
  const StateVector error = Difference(found, simulated->truth);
  constexpr int kBiasY = kStateBias + 1;
  EXPECT_GT(std::abs(error[kBiasY]), 4.0 * found.sigma()[kBiasY]);
  const Errors in_total = error.cwiseQuotient(*found.sigma_total()).tail<7>();
  EXPECT_LT(in_total.cwiseAbs().maxCoeff(), 3.0) << in_total.transpose();
}

}  // namespace
}  // namespace camgyro
