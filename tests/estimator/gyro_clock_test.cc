#include "estimator/gyro_clock.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/stamp_rate.h"
#include "core/time.h"
#include "estimator/calibrate.h"
#include "estimator/starting_point.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Scenario;
using simulation::Simulated;
using simulation::SimulateTracks;

// As a reader leaves it whose stretches agree to residual_s on the clock.
Recording Repaired(double residual_s) {
  Recording recording = SimulateTracks(ShortScenario(4.0)).value().recording;
  recording.gyro_stamps.emplace();
  recording.gyro_stamps->kind = StampKind::kArrival;
  recording.gyro_stamps->repaired = true;
  recording.gyro_stamps->residual_s = residual_s;
  recording.gyro_stamps->level_sigma_s = 0.3e-3;
  return recording;
}

const EffectSet::Item* SkewOf(const Calibration& calibration) {
  if (calibration.effects == nullptr) return nullptr;
  for (const EffectSet::Item& item : calibration.effects->items()) {
    if (item.entry->name == "clock_skew") return &item;
  }
  return nullptr;
}

// A clock whose rate shows is free to run at another one; one that is known well, or has its stamps
// as recorded, is not.
TEST(GyroClock, RateIsPartOfTheModelWhereItShows) {
  Recording recording = Repaired(1e-3);
  const double rate = GyroRateSigma(recording);
  EXPECT_GT(0.5 * GyroSpanS(recording) * rate, 50e-6);
  EXPECT_NEAR(std::stod(ShapeOfGyroClock(recording)), 1e6 * rate, 1.0);
  Calibration calibration;
  ASSERT_TRUE(AddStartEffects(recording, {}, "", ByPlane(), &calibration));
  ASSERT_NE(SkewOf(calibration), nullptr);
  EXPECT_GT(SkewOf(calibration)->effect->parameters()[0].spread, 1e6 * rate);

  const auto has_skew = [&](const PairResidual& residual) {
    Calibration other;
    EXPECT_TRUE(AddStartEffects(recording, {}, "", residual, &other));
    return SkewOf(other) != nullptr;
  };
  EXPECT_FALSE(has_skew(ByTransfer()));
  recording.gyro_stamps->repaired = false;
  EXPECT_FALSE(has_skew(ByPlane()));
  recording = Repaired(10e-6);
  EXPECT_FALSE(has_skew(ByPlane()));
}

// In the middle of the gyro's stamps the rate changes no delay, and the delay is that.
TEST(GyroClock, DelayIsThatInTheMiddle) {
  const Recording recording = Repaired(1e-3);
  Calibration calibration;
  calibration.delay_s = 0.018;
  ASSERT_TRUE(AddStartEffects(recording, {}, "", ByPlane(), &calibration));
  calibration.effect_values[SkewOf(calibration)->first] = 1000.0;
  const double middle_s = 0.5 * GyroSpanS(recording) - calibration.delay_s;
  EXPECT_NEAR(DelayOf(calibration, FrameTime(middle_s)), 0.018, 1e-9);
  EXPECT_NEAR(DelayOf(calibration, FrameTime(middle_s + 1.0)), 0.019, 1e-9);
}

// Offset and rate of the clock are in the covariance; the rate is in that of a delay at the first
// stamp, half of the recording away from where it does not matter.
TEST(GyroClock, WhatAFitCannotFindIsInItsCovariance) {
  const Recording recording = Repaired(1e-3);
  const double rate = GyroRateSigma(recording);
  Calibration calibration;
  calibration.lens[kFocal] = 500.0;
  AddGyroClock(recording, &calibration);
  EXPECT_NEAR(std::sqrt(calibration.covariance(kStateDelay, kStateDelay)), 0.3e-3, 1e-9);
  EXPECT_NEAR(std::sqrt(calibration.covariance(kStateFocal, kStateFocal)), 500.0 * rate, 1e-9);

  Calibration at_first;
  ASSERT_TRUE(AddStartEffects(recording, {}, "clock_skew", ByPlane(), &at_first));
  AddGyroClock(recording, &at_first);
  EXPECT_NEAR(std::sqrt(at_first.covariance(kStateDelay, kStateDelay)),
              std::hypot(0.3e-3, 0.5 * rate * GyroSpanS(recording)), 1e-9);

  Recording recorded = recording;
  recorded.gyro_stamps->repaired = false;
  Calibration untouched;
  AddGyroClock(recorded, &untouched);
  EXPECT_EQ(untouched.covariance, Calibration().covariance);
}

// A clock that was laid 800 ppm too fast through stamps that tell no better, 4 ms off at the ends
// of 10 s: a fit finds it from the pictures, and is left with their noise, and with the delay in
// the middle.
TEST(GyroClock, RateIsFoundFromThePictures) {
  constexpr double kRate = 800e-6;
  Scenario scenario = ShortScenario(10.0);
  scenario.tracks.noise_px = 0.2;
  const Simulated s = SimulateTracks(scenario).value();
  Recording found = s.recording;
  const int64_t middle_ns =
      found.gyro.front().stamp_ns + (found.gyro.back().stamp_ns - found.gyro.front().stamp_ns) / 2;
  for (GyroSample& sample : found.gyro) {
    sample.stamp_ns = StampAt(middle_ns, (1.0 + kRate) * SecondsSince(middle_ns, sample.stamp_ns));
  }
  found.gyro_stamps.emplace();
  found.gyro_stamps->kind = StampKind::kArrival;
  found.gyro_stamps->repaired = true;
  found.gyro_stamps->residual_s = 10e-3;
  const Prior prior = StartOffTheTruth(s.truth);
  const EstimationInput input = MakeEstimationInput(found, SelectPairs(found));
  Calibration start = prior.mean;
  ASSERT_TRUE(AddStartEffects(found, {}, "", ByPlane(), &start));
  ASSERT_NE(SkewOf(start), nullptr);
  const Result<Refined> without = Refine(input, input.pairs, prior.mean, prior, {});
  const Result<Refined> with = Refine(input, input.pairs, start, prior, {});
  ASSERT_TRUE(without.has_value() && with.has_value());
  EXPECT_GT(without->quality.noise_px, 0.3);
  EXPECT_NEAR(with->quality.noise_px, 0.2, 0.02);

  const int column = SkewOf(start)->first;
  const double sigma_ppm = std::sqrt(with->calibration.effect_covariance(column, column));
  EXPECT_LT(sigma_ppm, 40.0);
  EXPECT_NEAR(with->calibration.effect_values[column], 1e6 * kRate, 4.0 * sigma_ppm);
  Calibration whole = with->calibration;
  AddGyroClock(found, &whole);
  EXPECT_LT(ErrorInSigmas(whole, s.truth).cwiseAbs().maxCoeff(), 4.0);
}

}  // namespace
}  // namespace camgyro
