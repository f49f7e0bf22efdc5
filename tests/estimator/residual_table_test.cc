#include "estimator/residual_table.h"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "core/robust_statistics.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

struct Scene {
  simulation::Simulated simulated;
  EstimationInput input;
  PairGraphOptions options;
};

Scene MakeScene(double noise_px, simulation::Scenario scenario = ShortScenario(2.0)) {
  scenario.tracks.noise_px = noise_px;
  scenario.gyro.noise_density_rad_s_rtHz = 0.0;
  Scene scene;
  scene.simulated = *simulation::SimulateTracks(scenario);
  scene.input = MakeEstimationInput(scene.simulated.recording);
  return scene;
}

double Rms(const std::vector<MatchResidual>& rows) {
  double sum_sq = 0.0;
  for (const MatchResidual& row : rows) sum_sq += row.residual_px * row.residual_px;
  return std::sqrt(sum_sq / static_cast<double>(rows.size()));
}

TEST(ResidualTable, IsNoiseAtTheTruth) {
  const Scene scene = MakeScene(/*noise_px=*/0.7);
  const auto rows =
      ComputeResiduals(scene.input, scene.input.pairs, scene.simulated.truth, 0.7, scene.options);
  ASSERT_GT(rows.size(), 1500u);  // 50 tracks, 60 frames
  // Two of 50 degrees of freedom went to the direction.
  EXPECT_NEAR(Rms(rows), 0.7 * std::sqrt(48.0 / 50.0), 0.03);
  int inliers = 0;
  for (const MatchResidual& row : rows) inliers += row.inlier ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(inliers) / static_cast<double>(rows.size()), 0.9876, 0.01);

  // 30 ms late at some 5 rad/s^2 is 5 mrad, or 3 px, between the frames; parts of it a direction
  // can imitate.
  Calibration wrong = scene.simulated.truth;
  wrong.delay_s += 0.030;
  EXPECT_GT(Rms(ComputeResiduals(scene.input, scene.input.pairs, wrong, 0.7, scene.options)), 1.2);
}

TEST(ResidualTable, CorrectionTakesAShiftBack) {
  Scene scene = MakeScene(/*noise_px=*/0.0);
  scene.options.match_noise = MatchNoise::kSecondImage;
  std::vector<TimedPair> pairs = {scene.input.pairs[10]};
  const Eigen::Vector2d shift(0.3, -0.4);
  pairs[0].matches[7].px_b += shift;
  const auto rows =
      ComputeResiduals(scene.input, pairs, scene.simulated.truth, 0.05, scene.options);
  ASSERT_EQ(rows.size(), pairs[0].matches.size());
  const MatchResidual& row = rows[7];
  EXPECT_EQ(row.match.px_b, pairs[0].matches[7].px_b);
  EXPECT_FALSE(row.inlier);
  // Only the part across the epipolar line shows; it points back, and is the residual.
  const Eigen::Vector2d across = row.correction_px.normalized();
  EXPECT_NEAR(row.correction_px.norm(), std::abs(row.residual_px), 1e-6);
  EXPECT_NEAR(row.correction_px.dot(across), -shift.dot(across), 0.02);
  EXPECT_LT(row.correction_px.dot(shift), 0.0);
  // The others fit: what is left is the curvature of motion within a sample.
  for (size_t i = 0; i < rows.size(); ++i) {
    if (i == 7) continue;
    EXPECT_LT(std::abs(rows[i].residual_px), 0.05) << i;
  }
  // Exposed within the second frame, on the gyro's clock.
  const Calibration& truth = scene.simulated.truth;
  EXPECT_NEAR(
      row.time_s,
      pairs[0].time_b_s + truth.delay_s + truth.readout_s * row.match.px_b.y() / truth.height_px,
      1e-12);
}

TEST(ResidualTable, OfTransfersIsNoiseAtTheTruthAndTakesAShiftBack) {
  Scene scene = MakeScene(/*noise_px=*/0.7, FarScenario(2.0));
  scene.options.residual = &ByTransfer();
  const auto rows =
      ComputeResiduals(scene.input, scene.input.pairs, scene.simulated.truth, 0.7, scene.options);
  ASSERT_GT(rows.size(), 1500u);
  std::vector<double> magnitudes;
  double sum_sq_px = 0.0;
  for (const MatchResidual& row : rows) {
    magnitudes.push_back(row.residual_px);
    sum_sq_px += row.correction_px.squaredNorm();
  }
  EXPECT_NEAR(1.4826 * MedianInPlace(&magnitudes), 0.7, 0.03);
  // Two coordinates with the noise of both images.
  EXPECT_NEAR(std::sqrt(sum_sq_px / static_cast<double>(rows.size())), 2.0 * 0.7, 0.05);

  scene = MakeScene(/*noise_px=*/0.0, FarScenario(2.0));
  scene.options.residual = &ByTransfer();
  scene.options.match_noise = MatchNoise::kSecondImage;
  std::vector<TimedPair> pairs = {scene.input.pairs[10]};
  const Eigen::Vector2d shift(0.3, -0.4);
  pairs[0].matches[7].px_b += shift;
  const auto shifted =
      ComputeResiduals(scene.input, pairs, scene.simulated.truth, 0.05, scene.options);
  ASSERT_EQ(shifted.size(), pairs[0].matches.size());
  EXPECT_LT((shifted[7].correction_px + shift).norm(), 0.05);
  for (size_t i = 0; i < shifted.size(); ++i) EXPECT_EQ(shifted[i].inlier, i != 7) << i;
}

TEST(ResidualTable, LeavesOutWhatTheGyroDoesNotCover) {
  const Scene scene = MakeScene(/*noise_px=*/0.7);
  Calibration late = scene.simulated.truth;
  late.delay_s += 1e3;
  EXPECT_TRUE(ComputeResiduals(scene.input, scene.input.pairs, late, 0.7, scene.options).empty());
}

}  // namespace
}  // namespace camgyro
