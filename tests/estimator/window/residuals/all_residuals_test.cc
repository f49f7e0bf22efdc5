// What every row of the table has to keep, so that a new one is tested as it is added.
#include "estimator/window/residuals/all_residuals.h"

#include <gmock/gmock.h>

#include <cmath>
#include <set>
#include <string>

#include "core/so3.h"
#include "estimator/window/pair_graph_options.h"
#include "estimator/window/pair_view.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using simulation::Scenario;
using simulation::Simulated;
using simulation::SimulateTracks;

std::vector<const PairResidual*> AllResiduals() {
  std::vector<const PairResidual*> all = ChoosableResiduals();
  all.push_back(&ByAttitudes());
  return all;
}

TEST(AllResiduals, AreFoundByTheirNamesAndOthersAreRefusedWithThem) {
  std::set<std::string> names;
  for (const PairResidual* residual : ChoosableResiduals()) {
    const std::string name = residual->facts().name;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_THAT(residual->facts().help, ::testing::StartsWith(name));
    EXPECT_THAT(HelpOfResiduals(), ::testing::HasSubstr(residual->facts().help));
    const Result<const PairResidual*> found = FindResidual(name);
    ASSERT_TRUE(found.has_value()) << found.error().message;
    EXPECT_EQ(*found, residual);
    EXPECT_FALSE(residual->facts().of_attitudes);
  }
  const Result<const PairResidual*> none = FindResidual("attitudes");
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().kind, ErrorKind::kBadUsage);
  for (const std::string& name : names) {
    EXPECT_THAT(none.error().message, ::testing::HasSubstr(name));
  }
}

// A pair under the true calibration, as ViewPair gives it.
struct TruePair {
  explicit TruePair(const PairResidual& residual, bool far = true) {
    Scenario scenario = far ? FarScenario(0.2) : ShortScenario(0.2);
    scenario.tracks.noise_px = 0.0;
    scenario.gyro.noise_density_rad_s_rtHz = 0.0;
    scenario.gyro.bias_walk_rad_s2_rtHz = 0.0;
    const Simulated s = SimulateTracks(scenario).value();
    truth = s.truth;
    input = MakeEstimationInput(s.recording);
    pair = input.pairs.at(2);
    options.residual = &residual;
    if (residual.facts().of_attitudes) {
      // The gyro's own turn between the first rows.
      pair.matches.clear();
      pair.rotation.frame_b = pair.rotation.frame_a + 1;
      EXPECT_TRUE(ViewPair(input, pair, truth, 1.0, options, &view));
      const RotationChain chain(view.measurement.rate_times_s, view.rates);
      const Eigen::Matrix3d R_c = truth.q_gyro_cam.toRotationMatrix();
      pair.rotation.q_a_b = Eigen::Quaterniond(
          (chain.At(pair.time_a_s + truth.delay_s).R_ref_gyro * R_c).transpose() *
          chain.At(pair.time_b_s + truth.delay_s).R_ref_gyro * R_c);
    }
    EXPECT_TRUE(ViewPair(input, pair, truth, 0.5, options, &view));
    measurement = std::make_shared<PairMeasurement>(view.measurement);
    shutter = ShutterOf(truth);
    if (!residual.facts().of_attitudes) plane = FitPlane(view);
    at.lens = truth.lens.data();
    at.shutter = shutter.data();
    at.q_gyro_cam = truth.q_gyro_cam.coeffs().data();
    at.tau = plane.tau.data();
    at.bend = plane.bend.data();
    at.rates = {view.rates.data()};
  }
  Calibration truth;
  EstimationInput input;
  TimedPair pair;
  PairGraphOptions options;
  PairView view;
  PairPlane plane;
  ShutterParameters shutter;
  std::shared_ptr<PairMeasurement> measurement;
  PairParameters at;
};

TEST(AllResiduals, CostsHaveTheBlocksThatTheySayAndVanishAtTheTruth) {
  for (const PairResidual* residual : AllResiduals()) {
    SCOPED_TRACE(residual->facts().name);
    const TruePair t(*residual);
    const auto cost = residual->MakeCost(t.measurement, /*id=*/7);
    const std::vector<BlockKind> blocks = residual->Blocks(*t.measurement);
    ASSERT_EQ(cost->parameter_block_sizes().size(), blocks.size());
    const std::vector<const double*> parameters = t.at.InOrder(blocks);
    Eigen::VectorXd r(cost->num_residuals());
    ASSERT_TRUE(cost->Evaluate(parameters.data(), r.data(), nullptr));
    PairBearings bearings;
    const std::vector<double> independent = residual->Independent(t.measurement, t.at, &bearings);
    const size_t expected =
        residual->facts().of_attitudes
            ? 3
            : static_cast<size_t>(residual->facts().per_match) * t.measurement->matches.size();
    EXPECT_EQ(independent.size(), expected);
    // Interpolated rates turn by less than a tenth of half a pixel; determinants of nearly no
    // parallax say nothing.
    if (residual != &ByDeterminant()) {
      EXPECT_LT(r.cwiseAbs().maxCoeff(), 0.1);
    }
    for (const double value : independent) EXPECT_LT(std::abs(value), 0.1);
  }
}

// A match that is far off is an outlier, and no other one is, with a correction back to it.
TEST(AllResiduals, ExplainsAWrongMatch) {
  for (const PairResidual* residual : ChoosableResiduals()) {
    SCOPED_TRACE(residual->facts().name);
    TruePair t(*residual, /*far=*/residual == &ByTransfer());  // else parallax tells the direction
    t.pair.matches.at(4).px_b += Eigen::Vector2d(8.0, 6.0);
    PairView view;
    std::vector<MatchMisfit> misfits;
    ASSERT_TRUE(
        residual->Explain(t.input, t.pair, t.truth, 0.5, t.options, std::nullopt, &view, &misfits));
    ASSERT_EQ(misfits.size(), view.measurement.matches.size());
    std::vector<double> unseen;
    ASSERT_TRUE(residual->Unseen(t.input, t.pair, t.truth, 0.5, t.options, &unseen));
    EXPECT_FALSE(unseen.empty());
    for (size_t i = 0; i < misfits.size(); ++i) {
      EXPECT_TRUE(misfits[i].inlier || i == 4) << i;
    }
    EXPECT_LT(misfits.at(4).correction_px.dot(Eigen::Vector2d(8.0, 6.0)), 0.0);
    // Too few matches are no pair.
    t.pair.matches.resize(7);
    EXPECT_FALSE(
        residual->Explain(t.input, t.pair, t.truth, 0.5, t.options, std::nullopt, &view, &misfits));
    EXPECT_FALSE(residual->Unseen(t.input, t.pair, t.truth, 0.5, t.options, &unseen));
  }
}

TEST(AllResiduals, PairsOfAttitudesHaveTheirOwn) {
  PairGraphOptions options;
  options.residual = &ByTransfer();
  TimedPair pair;
  EXPECT_EQ(&ResidualOf(pair, options), &ByTransfer());  // a pair that has lost its matches
  pair.rotation.frame_b = 1;
  EXPECT_EQ(&ResidualOf(pair, options), &ByAttitudes());
  pair.matches.resize(8);
  EXPECT_EQ(&ResidualOf(pair, options), &ByTransfer());
}

}  // namespace
}  // namespace camgyro
