// What is marked as not determined, and doubted.
#include "estimator/doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

// An action camera on a gimbal ended with 2.4 ± 0.9 px, and with a centre that looked determined.
TEST(Doubts, NothingIsBelievedOfAFocalLengthThatNoLensHas) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(1.0)).value();
  const Prior prior = StartOffTheTruth(s.truth);
  const auto fit_with = [&](double focal_px) {
    CalibrationReport report;
    report.converged = true;
    report.calibration = s.truth;
    report.calibration.lens[kFocal] = focal_px;
    const StateVector sigma = 0.01 * prior.sigma;
    report.calibration.covariance = sigma.cwiseAbs2().asDiagonal();
    MarkDetermined(/*attitudes=*/false, prior, &report.calibration);
    AddDoubts(s.recording, &report);
    return report;
  };
  const auto count = [](const CalibrationReport& report) {
    const auto& determined = report.calibration.determined;
    return std::count(determined.begin(), determined.end(), true);
  };
  const CalibrationReport right = fit_with(s.truth.lens[kFocal]);
  EXPECT_EQ(count(right), kStateSize);
  EXPECT_THAT(right.doubts, ::testing::IsEmpty());
  for (const double focal_px : {2.4, -500.0, 10572.0}) {
    const CalibrationReport report = fit_with(focal_px);
    EXPECT_EQ(count(report), 0);
    ASSERT_FALSE(report.doubts.empty());
    EXPECT_THAT(report.doubts.front(), ::testing::HasSubstr("ran away"));
  }
}

}  // namespace
}  // namespace camgyro
