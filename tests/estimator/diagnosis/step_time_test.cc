#include "estimator/diagnosis/step_time.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/effects/catalogue.h"
#include "estimator/window/gyro_noise.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

// A walk whose delay steps from 10 to 20 ms, and a calibration that has the step at `shape`.
class StepTime : public testing::Test {
 protected:
  StepTime() {
    auto scenario = simulation::ParseScenario(
        "duration_s: 10", {"tracks.noise_px=0.7", "motion.kind=walking",
                           "effects.delay_step.time_s=5", "effects.delay_step.step_s=0.01"});
    EXPECT_TRUE(scenario) << scenario.error().message;
    auto simulated = simulation::SimulateTracks(*scenario, 3);
    EXPECT_TRUE(simulated) << simulated.error().message;
    recording_ = std::move(simulated->recording);
    calibration_ = simulated->truth;
    input_ = MakeEstimationInput(recording_, SelectPairs(recording_));
    options_.gyro_sigma_rad_s = GyroSigma(recording_, calibration_.delay_s);
    const auto by_time = MakeEffectSetup(recording_, calibration_).frames;
    for (size_t i = 1; i < by_time.size(); ++i) {
      if (simulated->frames[i].delay_s - simulated->frames[i - 1].delay_s > 0.005) {
        before_s_ = by_time[i - 1].stamp_s;
        after_s_ = by_time[i].stamp_s;
      }
    }
  }

  double Place(const std::vector<TimedPair>& pairs, const std::string& shape) {
    const EffectEntry* entry = FindEffect("delay_step");
    auto set = std::make_shared<EffectSet>();
    set->Add(entry, shape, entry->make(MakeEffectSetup(recording_, calibration_), shape));
    Calibration calibration = calibration_;
    calibration.effects = set;
    calibration.effect_values = Eigen::VectorXd::Constant(1, 0.01);
    EXPECT_TRUE(PlaceDelaySteps(recording_, input_, pairs, 1.0, 0.7, options_, &calibration));
    EXPECT_FALSE(PlaceDelaySteps(recording_, input_, pairs, 1.0, 0.7, options_, &calibration));
    return std::stod(calibration.effects->items().front().shape);
  }

  Recording recording_;
  Calibration calibration_;  // before the step
  EstimationInput input_;
  PairGraphOptions options_;
  double before_s_ = 0.0, after_s_ = 0.0;  // stamps of the frames about the step
};

TEST_F(StepTime, IsFoundToTheFrame) {
  ASSERT_GT(before_s_, 4.0);
  for (const char* shape : {"4.4", "5.6"}) {
    const double time_s = Place(input_.pairs, shape);
    // A pair begins at every other frame.
    EXPECT_GT(time_s, before_s_ - 0.04) << shape;
    EXPECT_LT(time_s, after_s_ + 0.04) << shape;
  }
}

TEST_F(StepTime, IsInTheMiddleOfFramesThatNoPairHas) {
  std::vector<TimedPair> pairs;
  double last_before_s = 0.0, first_after_s = 1e9;
  for (const TimedPair& pair : input_.pairs) {
    if (pair.time_b_s > 4.3 && pair.time_a_s < 5.2) continue;
    pairs.push_back(pair);
    if (pair.time_b_s < 5.0) last_before_s = std::max(last_before_s, pair.time_b_s);
    if (pair.time_a_s > 5.0) first_after_s = std::min(first_after_s, pair.time_a_s);
  }
  EXPECT_NEAR(Place(pairs, "5.1"), 0.5 * (last_before_s + first_after_s), 0.04);
}

// Whether the calibration has the delay before it or after it, and also where frames have times of
// their own, which would take the step for themselves.
TEST_F(StepTime, OfALargeStepIsBetweenTheBlocks) {
  std::vector<PairBlock> blocks(5);
  for (const TimedPair& pair : input_.pairs) {
    if (pair.time_a_s <= 2.0) continue;
    const auto at = static_cast<size_t>(pair.time_a_s - 2.0);
    if (at < blocks.size()) blocks[at].push_back(pair);
  }
  const double delay_s = calibration_.delay_s;
  auto own_times = std::make_shared<EffectSet>();
  const EffectEntry* jitter = FindEffect("frame_stamp_jitter");
  own_times->Add(jitter, "spread",
                 jitter->make(MakeEffectSetup(recording_, calibration_), "spread"));
  for (const double off_s : {0.0, 0.01, 0.0}) {
    if (calibration_.delay_s > delay_s) {
      calibration_.effects = own_times;
      calibration_.effect_values = Eigen::VectorXd::Constant(1, 0.02);
    }
    calibration_.delay_s = delay_s + off_s;
    const auto step = FindLargeStep(input_, blocks, calibration_, 0.7, options_);
    ASSERT_TRUE(step);
    EXPECT_NEAR(step->delay_s, delay_s, 2e-3) << off_s;
    EXPECT_NEAR(step->step_s, 0.01, 2e-3) << off_s;
    EXPECT_NEAR(step->time_s, after_s_, 0.1) << off_s;
    EXPECT_GT(step->explained, 0.8) << off_s;
  }
}

// The shape has four decimals; a step after the last frame is none.
TEST_F(StepTime, MayEndWithAFrameWhoseStampRoundsUp) {
  const auto last_s = [&] {
    return MakeEffectSetup(recording_, calibration_).frames.back().stamp_s;
  };
  while (std::fmod(1e4 * last_s(), 1.0) < 0.6) {
    recording_.frames.pop_back();
    recording_.tracks.pop_back();
  }
  ASSERT_GT(last_s(), 9.0);
  input_ = MakeEstimationInput(recording_, SelectPairs(recording_));
  EXPECT_NEAR(Place(input_.pairs, "5.6"), 0.5 * (before_s_ + after_s_), 0.06);
}

}  // namespace
}  // namespace camgyro
