// What is marked as not determined, and doubted.
#include "estimator/doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

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

TEST(Doubts, UnseenFramesThatFitWorseBeyondTheGyrosNoise) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(1.0)).value();
  const auto doubts_of = [&](double unseen_px, double gyro_px) {
    CalibrationReport report;
    report.converged = true;
    report.calibration = s.truth;
    report.quality.usual_rms_px = 0.5;
    report.unseen = UnseenFit{100, 5000, 5.0, unseen_px, gyro_px};
    EXPECT_NEAR(0.5 * UnseenRatio(report),
                std::sqrt(std::max(0.0, unseen_px * unseen_px - gyro_px * gyro_px)), 1e-12);
    AddDoubts(s.recording, &report);
    return report.doubts;
  };
  EXPECT_THAT(doubts_of(0.58, 0.0), ::testing::IsEmpty());
  EXPECT_THAT(doubts_of(0.62, 0.0), ::testing::ElementsAre(::testing::HasSubstr("fit worse")));
  EXPECT_THAT(doubts_of(0.8, 0.1), ::testing::ElementsAre(::testing::HasSubstr("fit worse")));
  EXPECT_THAT(doubts_of(0.8, 0.7), ::testing::IsEmpty());
}

TEST(Doubts, AGyroThatShowsMoreNoiseThanIsDeclaredIsNoted) {
  simulation::Simulated s = simulation::SimulateTracks(ShortScenario(4.0)).value();
  std::optional<double>& declared = s.recording.gyro_info.noise_density_rad_s_rtHz;
  ASSERT_TRUE(declared);
  const auto notes_of = [&] {
    CalibrationReport report;
    report.converged = true;
    report.calibration = s.truth;
    AddDoubts(s.recording, &report);
    EXPECT_THAT(report.doubts, ::testing::IsEmpty());
    return report.notes;
  };
  EXPECT_THAT(notes_of(), ::testing::IsEmpty());
  const double right = *declared;
  declared = 10.0 * right;
  EXPECT_THAT(notes_of(), ::testing::IsEmpty());
  declared = 0.2 * right;
  EXPECT_THAT(notes_of(), ::testing::ElementsAre(::testing::HasSubstr("motors that shake it")));
  declared.reset();
  EXPECT_THAT(notes_of(), ::testing::IsEmpty());
}

// A gimbal's camera ended with 4013 ± 2217 px and a readout of 0.4 ± 0.3 ms, which is 10 or more;
// in the middle row its delay is right.
TEST(Doubts, WithoutAReadoutTheDelayOfTheFirstRowIsUnknown) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(1.0)).value();
  const Prior prior = StartOffTheTruth(s.truth);
  CalibrationReport settled;
  settled.prior = prior;
  settled.calibration = s.truth;
  settled.calibration.delay_s = -0.018;
  settled.calibration.readout_s = 0.004;
  const StateVector sigma = 0.01 * prior.sigma;
  settled.calibration.covariance = sigma.cwiseAbs2().asDiagonal();
  MarkDetermined(/*attitudes=*/false, prior, &settled.calibration);
  for (const bool ran_away : {false, true}) {
    CalibrationReport report = settled;
    DisbelieveFit(ran_away, &report);
    const Calibration& c = report.calibration;
    ASSERT_EQ(report.doubts.size(), ran_away ? 1U : 0U);
    if (ran_away) {
      EXPECT_THAT(report.doubts.front(),
                  ::testing::HasSubstr("in the middle row it is -16.0 ± 0."));
    }
    EXPECT_FALSE(c.determined[kStateFocal]);
    EXPECT_FALSE(c.determined[kStateReadout]);
    EXPECT_TRUE(c.determined[kStateBias]);
    const double half_s = ran_away ? 0.5 * prior.sigma[kStateReadout] : 0.0;
    EXPECT_NEAR(c.sigma()[kStateDelay], std::hypot(sigma[kStateDelay], half_s), 1e-12);
    EXPECT_EQ(c.determined[kStateDelay], c.sigma()[kStateDelay] < 3e-3);
  }
}

// A lens that bends lines and that nothing declares sends the focal length of a fit to thrice of
// what it is; that of the rotations stays.
TEST(Doubts, AFocalLengthFarFromThatOfTheRotations) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(1.0)).value();
  CalibrationReport report;
  report.converged = true;
  report.calibration = s.truth;
  const double focal_px = s.truth.lens[kFocal];
  report.start.focal = StartFocal{focal_px, 0.02 * focal_px, /*determined=*/true, 0.5, {}};
  const auto doubts_of = [&](double found_px) {
    report.doubts.clear();
    report.calibration.lens[kFocal] = found_px;
    AddDoubts(s.recording, &report);
    return report.doubts;
  };
  for (const double as_it_was : {0.9, 1.0, 1.1}) {
    EXPECT_THAT(doubts_of(as_it_was * focal_px), ::testing::IsEmpty());
  }
  for (const double far : {0.6, 1.5, 3.0}) {
    EXPECT_THAT(doubts_of(far * focal_px),
                ::testing::ElementsAre(::testing::HasSubstr("--effects=radial_distortion")));
  }
  report.start.focal->determined = false;
  EXPECT_THAT(doubts_of(3.0 * focal_px), ::testing::IsEmpty());
}

}  // namespace
}  // namespace camgyro
