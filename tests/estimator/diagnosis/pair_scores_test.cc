// Scores where the model has frames' own times (of everything else: score_test_test.cc).
#include "estimator/diagnosis/pair_scores.h"

#include <gmock/gmock.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "estimator/diagnosis/score_test.h"
#include "estimator/window/gyro_noise.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

simulation::Simulated Simulate(const std::string& scenario,
                               const std::vector<std::string>& overrides) {
  return simulation::SimulateTracks(simulation::ParseScenario(scenario, overrides).value(), 4)
      .value();
}

struct ScoreSum {
  double chi2 = 0.0, log_det = 0.0;
  int residuals = 0;
  double pairs_delay_chi2 = 0.0;  // g^2 / H of t_d, summed over the pairs
  int pairs = 0;
  double delay_chi2 = 0.0;  // the same, over the blocks
  double focal_chi2 = 0.0;  // of f
  double focal_information = 0.0;
  int blocks = 0;
};

// With that spread of the frames' times, 0 without.
Scores ScoresOf(const Recording& recording, Calibration model, double spread_s,
                size_t pairs_of_a_block = 5,
                std::shared_ptr<const EffectSet> candidates = nullptr) {
  const EstimationInput input = MakeEstimationInput(recording, SelectPairs(recording));
  if (spread_s > 0.0) {
    const auto effects = MakeEffects("frame_stamp_jitter", MakeEffectSetup(recording, model));
    EXPECT_TRUE(effects);
    model.effects = std::make_shared<EffectSet>(*effects);
    model.effect_values = Eigen::VectorXd::Constant(1, spread_s);
  }
  PairGraphOptions options;
  options.match_noise = recording.match_noise;
  options.gyro_sigma_rad_s = GyroSigma(recording, model.delay_s);
  std::vector<PairBlock> blocks;
  for (size_t i = 0; i < input.pairs.size(); ++i) {
    if (i % pairs_of_a_block == 0) blocks.emplace_back();
    blocks.back().push_back(input.pairs[i]);
  }
  return ComputeScores(input, blocks, model, std::move(candidates), 0.5, options);
}

// At the truth.
ScoreSum ScoreAt(const simulation::Simulated& simulated, double spread_s,
                 size_t pairs_of_a_block = 5) {
  const Scores scores = ScoresOf(simulated.recording, simulated.truth, spread_s, pairs_of_a_block);
  ScoreSum sum;
  for (const BlockScore& block : scores.blocks) {
    sum.chi2 += block.chi2;
    sum.log_det += block.log_det;
    sum.residuals += block.residuals;
    sum.delay_chi2 +=
        block.g[kStateDelay] * block.g[kStateDelay] / block.H(kStateDelay, kStateDelay);
    sum.focal_chi2 +=
        block.g[kStateFocal] * block.g[kStateFocal] / block.H(kStateFocal, kStateFocal);
    sum.focal_information += block.H(kStateFocal, kStateFocal);
    ++sum.blocks;
  }
  // Its pairs are parts of a block.
  std::vector<BlockScore> parts = scores.blocks;
  for (const PairScore& pair : scores.pairs) {
    sum.pairs_delay_chi2 +=
        pair.g[kStateDelay] * pair.g[kStateDelay] / pair.H(kStateDelay, kStateDelay);
    ++sum.pairs;
    BlockScore& rest = parts[static_cast<size_t>(pair.block)];
    rest.g -= pair.g;
    rest.H.topLeftCorner(scores.num_model, scores.num_model) -= pair.H;
    rest.chi2 -= pair.chi2;
    rest.log_det -= pair.log_det;
  }
  for (size_t b = 0; b < parts.size(); ++b) {
    EXPECT_LT(parts[b].g.norm(), 1e-9 * scores.blocks[b].g.norm());
    EXPECT_LT(parts[b].H.norm(), 1e-9 * scores.blocks[b].H.norm());
    EXPECT_NEAR(parts[b].chi2, 0.0, 1e-9 * scores.blocks[b].chi2);
    EXPECT_NEAR(parts[b].log_det, 0.0, 1e-9);
  }
  return sum;
}

TEST(PairScores, AllowForTheFramesOwnTimes) {
  const simulation::Simulated simulated =
      Simulate("duration_s: 12\nmotion: {kind: running}\ntracks: {count: 60, noise_px: 0.5}",
               {"effects.frame_stamp_jitter.spread_s=0.002"});
  const ScoreSum without = ScoreAt(simulated, 0.0), with = ScoreAt(simulated, 0.002);
  // As the noise lets expect, and not without.
  EXPECT_GT(without.chi2, 1.5 * without.residuals);
  EXPECT_NEAR(with.chi2 / with.residuals, 1.0, 0.1);
  EXPECT_EQ(without.log_det, 0.0);
  // So does what a pair says of the delay (here they have no frame in common): each is chi-square
  // of one degree of freedom.
  EXPECT_GT(without.pairs_delay_chi2, 3.0 * without.pairs);
  EXPECT_NEAR(with.pairs_delay_chi2 / with.pairs, 1.0, 5.0 * std::sqrt(2.0 / with.pairs));
  // So does what a block says of the delay, and of the focal length.
  EXPECT_GT(without.delay_chi2, 3.0 * without.blocks);
  EXPECT_NEAR(with.delay_chi2 / with.blocks, 1.0, 4.0 * std::sqrt(2.0 / with.blocks));
  EXPECT_NEAR(with.focal_chi2 / with.blocks, 1.0, 4.0 * std::sqrt(2.0 / with.blocks));
  // The likelihood, times integrated out, is largest at the truth; chi2 alone falls with any
  // spread.
  const ScoreSum less = ScoreAt(simulated, 0.001), more = ScoreAt(simulated, 0.004);
  EXPECT_LT(with.chi2 + with.log_det, less.chi2 + less.log_det);
  EXPECT_LT(with.chi2 + with.log_det, more.chi2 + more.log_det);
  EXPECT_LT(more.chi2, with.chi2);
}

// Where pairs follow one another, the second frame of one is the first of the next, at one time:
// what makes one interval longer makes the other shorter, so that both together say more of the
// focal length than each by itself.
TEST(PairScores, NeighboursShareTheTimeOfAFrame) {
  const simulation::Simulated simulated =
      Simulate("duration_s: 6\nmotion: {kind: running}\ntracks: {count: 60, reanchored: true}",
               {"effects.frame_stamp_jitter.spread_s=0.002"});
  const ScoreSum together = ScoreAt(simulated, 0.002), alone = ScoreAt(simulated, 0.002, 1);
  EXPECT_GT(together.focal_information, 2.0 * alone.focal_information);
  EXPECT_LT(together.chi2 + together.log_det, alone.chi2 + alone.log_det);
  const double without = ScoreAt(simulated, 0.0).focal_information;
  EXPECT_LT(together.focal_information, without);
  EXPECT_NEAR(ScoreAt(simulated, 0.0, 1).focal_information, without, 1e-9 * without);
}

// What the model lacks makes each pair see times of its own, which neighbours do not share: the
// scores are to know what all of a block's pairs say of a frame's time.
TEST(PairScores, TellWhatWrongTimesHide) {
  const simulation::Simulated simulated = Simulate(
      "duration_s: 10\ncamera: {rate_hz: 15}\nmotion: {kind: running}\n"
      "tracks: {count: 100, noise_px: 0.1, reanchored: true}",
      {"effects.frame_stamp_jitter.spread_s=0.003", "effects.gyro_scale.error=[0.005, 0.005, 0]"});
  const Recording& recording = simulated.recording;
  const auto candidates = MakeEffects("gyro_scale", MakeEffectSetup(recording, simulated.truth));
  ASSERT_TRUE(candidates);
  const Scores scores =
      ScoresOf(recording, simulated.truth, 0.003, 20, std::make_shared<EffectSet>(*candidates));
  std::vector<int> columns;
  for (int i = 0; i < 3; ++i) columns.push_back(scores.num_model + i);
  const Eigen::VectorXd step = StepOf(scores, columns, Eigen::VectorXd::Zero(scores.num_model + 3));
  EXPECT_NEAR(step[columns[0]], 0.005, 0.001);
  EXPECT_NEAR(step[columns[1]], 0.005, 0.001);
  EXPECT_NEAR(step[columns[2]], 0.0, 0.001);
}

}  // namespace
}  // namespace camgyro
