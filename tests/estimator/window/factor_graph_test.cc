// Marginalisation in the graph: windows against batches, rotations at their optimum, odd blocks.
#include "estimator/window/factor_graph.h"

#include <ceres/sized_cost_function.h>
#include <gmock/gmock.h>

#include <Eigen/Dense>

#include "core/linear_algebra.h"
#include "core/rotation_chain.h"
#include "core/so3.h"
#include "factors/bias_walk.h"
#include "factors/gyro_rate.h"
#include "factors/marginal_prior.h"
#include "factors/relative_rotation.h"
#include "tests/estimator/window/linear_factor.h"

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const SolveOptions kToTheEnd{200, 1e-30};

BlockId Shutter() { return {BlockKind::kShutter, 0}; }
BlockId Rotation() { return {BlockKind::kRotation, 0}; }
BlockId Bias(int64_t i) { return {BlockKind::kBias, i}; }
BlockId Rates(int64_t i) { return {BlockKind::kRates, i}; }

Block Euclidean(const VectorXd& value) { return {Geometry::kEuclidean, value, {}}; }

std::vector<FactorGraph::FactorKey> AllKeys(const FactorGraph& graph) {
  std::vector<FactorGraph::FactorKey> keys;
  for (const auto& entry : graph.factors()) keys.push_back(entry.first);
  return keys;
}

// A residual that nothing changes, as the noise of many matches, beside one of a parameter.
class LargeAndSmall : public ceres::SizedCostFunction<2, 1> {
 public:
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    residuals[0] = 2000.0;
    residuals[1] = x[0][0] - 3.0;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = 0.0;
      jacobians[0][1] = 1.0;
    }
    return true;
  }
};

// Three sigmas off, which lower the cost by two millionths.
TEST(FactorGraph, TheNumberOfFactorsDoesNotDecideWhenAParameterHasSettled) {
  FactorGraph graph;
  graph.AddBlock(Bias(0), Euclidean(VectorXd::Zero(1)));
  graph.AddFactor(std::make_shared<LargeAndSmall>(), {Bias(0)});
  ASSERT_TRUE(graph.Solve({10, 1e-5}).usable);
  EXPECT_EQ(graph.value(Bias(0))[0], 0.0);
  ASSERT_TRUE(graph.Solve({10, 1e-5, 0.005}).usable);
  EXPECT_NEAR(graph.value(Bias(0))[0], 3.0, 0.1);
}

// x^4 / 2, whose steps fall short: each takes a half off.
class Flat : public ceres::SizedCostFunction<1, 1> {
 public:
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    residuals[0] = x[0][0] * x[0][0];
    if (jacobians != nullptr && jacobians[0] != nullptr) jacobians[0][0] = 2.0 * x[0][0];
    return true;
  }
};

TEST(FactorGraph, WhoAsksForTheSolveSeesEachStepAndSaysWhenItHasSettled) {
  FactorGraph graph;
  graph.AddBlock(Bias(0), Euclidean(VectorXd::Constant(1, 1.0)));
  graph.AddFactor(std::make_shared<Flat>(), {Bias(0)});
  std::vector<double> seen;
  SolveOptions options{50, 1e-30};
  options.settled = [&] {
    seen.push_back(graph.value(Bias(0))[0]);
    return seen.back() < 0.1;
  };
  const SolveReport report = graph.Solve(options);
  ASSERT_TRUE(report.usable);
  ASSERT_GT(seen.size(), 2u);
  EXPECT_EQ(report.iterations, static_cast<int>(seen.size()));
  EXPECT_GT(seen[seen.size() - 2], 0.1);
  EXPECT_EQ(graph.value(Bias(0))[0], seen.back());
}

// Every tangent coordinate of every block as a functional.
std::vector<FactorGraph::Functional> AllCoordinates(const FactorGraph& graph,
                                                    const std::vector<BlockId>& blocks) {
  std::vector<FactorGraph::Functional> functionals;
  for (const BlockId& id : blocks) {
    for (int c = 0; c < graph.block(id).tangent_size(); ++c) functionals.push_back({{id, c, 1.0}});
  }
  return functionals;
}

MatrixXd CovarianceOf(const FactorGraph& graph, const std::vector<BlockId>& blocks) {
  const auto report = graph.Covariance(AllCoordinates(graph, blocks));
  EXPECT_TRUE(report.has_value()) << report.error().message;
  return report->covariance;
}

// Step i of a linear problem shaped like the estimator's: rates and a bias per step, one block that
// all steps share.
void AddLinearStep(int i, FactorGraph* graph) {
  RandomNumbers random(100 + static_cast<uint64_t>(i));
  graph->AddBlock(Bias(i), Euclidean(random.Vector(3)));
  graph->AddBlock(Rates(i), Euclidean(random.Vector(6)));
  const MatrixXd measured = random.Matrix(3, 2);
  graph->AddFactor(std::make_shared<GyroRate>(measured, Vector3d(0.3, 0.4, 0.5)),
                   {Rates(i), Bias(i)});
  if (i == 0) {
    graph->AddFactor(random.Factor(3, {3}), {Bias(0)});
    return;
  }
  graph->AddFactor(std::make_shared<BiasWalk>(0.2, 1.5), {Bias(i - 1), Bias(i)});
  graph->AddFactor(random.Factor(4, {2, 6, 6}), {Shutter(), Rates(i - 1), Rates(i)});
}

// Solves, and checks the solution with a dense solver, whose last step it takes:
// Levenberg-Marquardt ends where the cost, to its rounding, does not fall any more, some 1e-9 away.
void SolveLinear(FactorGraph* graph) {
  ASSERT_TRUE(graph->Solve(kToTheEnd).usable);
  const Linearization linear = graph->Linearize(AllKeys(*graph)).value();
  const VectorXd step = -LeastSquares(linear.J, linear.residuals);
  EXPECT_LT(step.norm(), 1e-7);
  for (size_t k = 0; k < linear.blocks.size(); ++k) {
    graph->value(linear.blocks[k]) +=
        step.segment(linear.offsets[k], linear.offsets[k + 1] - linear.offsets[k]);
  }
}

TEST(FactorGraph, WindowOfALinearProblemEqualsTheBatch) {
  constexpr int kSteps = 25, kWindow = 4;
  FactorGraph batch, window;
  for (FactorGraph* graph : {&batch, &window}) {
    graph->AddBlock(Shutter(), Euclidean(Eigen::Vector2d(1.0, -2.0)));
    graph->AddFactor(RandomNumbers(1).Factor(2, {2}), {Shutter()});
  }
  for (int i = 0; i < kSteps; ++i) {
    AddLinearStep(i, &batch);
    AddLinearStep(i, &window);
    ASSERT_TRUE(window.Solve({2, 1e-6}).usable);  // roughly: where it is linearised must not matter
    if (i >= kWindow) {
      EXPECT_EQ(window.Marginalize({Rates(i - kWindow), Bias(i - kWindow)}).value(), 0);
    }
  }
  EXPECT_EQ(window.blocks().size(), 1u + 2u * kWindow);
  SolveLinear(&batch);
  SolveLinear(&window);

  std::vector<BlockId> stay;
  for (const auto& entry : window.blocks()) stay.push_back(entry.first);
  for (const BlockId& id : stay) {
    EXPECT_LT((window.value(id) - batch.value(id)).norm(), 1e-9) << static_cast<int>(id.kind);
  }
  const MatrixXd expected = CovarianceOf(batch, stay);
  EXPECT_LT((CovarianceOf(window, stay) - expected).cwiseAbs().maxCoeff(),
            1e-9 * expected.diagonal().maxCoeff());
}

// As a Kalman filter predicts: the mean stays, and the covariance grows by the step's.
TEST(FactorGraph, WhatStaysMayHaveWalkedSince) {
  FactorGraph graph;
  graph.AddBlock(Shutter(), Euclidean(Eigen::Vector2d(1.0, -2.0)));
  graph.AddFactor(RandomNumbers(1).Factor(2, {2}), {Shutter()});
  AddLinearStep(0, &graph);
  AddLinearStep(1, &graph);
  SolveLinear(&graph);
  const VectorXd mean = graph.value(Shutter());
  const MatrixXd before = CovarianceOf(graph, {Shutter()});
  const FactorGraph::Walk walk{{{Shutter(), 0, 2.0}, {Shutter(), 1, -0.5}}, 0.3};
  const std::vector<BlockId> leaving = {Rates(0), Rates(1), Bias(0), Bias(1)};
  EXPECT_EQ(graph.Marginalize(leaving, AllKeys(graph), walk).value(), 0);
  graph.value(Shutter()) += Eigen::Vector2d(0.7, 0.4);
  SolveLinear(&graph);
  EXPECT_LT((graph.value(Shutter()) - mean).norm(), 1e-9);
  const Eigen::Vector2d direction(2.0, -0.5);
  const MatrixXd expected = before + 0.3 * 0.3 * direction * direction.transpose();
  EXPECT_LT((CovarianceOf(graph, {Shutter()}) - expected).cwiseAbs().maxCoeff(),
            1e-9 * expected.diagonal().maxCoeff());
}

TEST(FactorGraph, CovarianceOfFunctionalsIsTheInverseOfTheDenseInformation) {
  FactorGraph graph;
  graph.AddBlock(Shutter(), Euclidean(Eigen::Vector2d(1.0, -2.0)));
  graph.AddFactor(RandomNumbers(1).Factor(2, {2}), {Shutter()});
  for (int i = 0; i < 6; ++i) AddLinearStep(i, &graph);
  const Linearization linear = graph.Linearize(AllKeys(graph)).value();
  const MatrixXd dense = (linear.J.transpose() * linear.J).inverse();
  const MatrixXd got = CovarianceOf(graph, linear.blocks);
  ASSERT_EQ(got.rows(), dense.rows());
  EXPECT_LT((got - dense).norm(), 1e-9 * dense.norm());

  // A sum over blocks: weights 0.5 and -2 on two coordinates.
  const auto report = graph.Covariance({{{Bias(2), 1, 0.5}, {Rates(4), 3, -2.0}}}).value();
  VectorXd weights = VectorXd::Zero(dense.rows());
  for (size_t k = 0; k < linear.blocks.size(); ++k) {
    if (linear.blocks[k] == Bias(2)) weights[linear.offsets[k] + 1] = 0.5;
    if (linear.blocks[k] == Rates(4)) weights[linear.offsets[k] + 3] = -2.0;
  }
  EXPECT_NEAR(report.covariance(0, 0), weights.dot(dense * weights), 1e-9);

  // The effect of all residuals together is the Newton step.
  VectorXd sum = VectorXd::Zero(1);
  for (const auto& entry : report.influence) sum += entry.second;
  const VectorXd newton = -dense * (linear.J.transpose() * linear.residuals);
  EXPECT_NEAR(-sum[0], weights.dot(newton), 1e-9);
}

TEST(FactorGraph, WithoutInformationThereIsNoCovariance) {
  FactorGraph graph;
  graph.AddBlock(Shutter(), Euclidean(Eigen::Vector2d(1.0, -2.0)));
  MatrixXd row(1, 2);
  row << 1.0, 0.0;
  graph.AddFactor(std::make_shared<LinearFactor>(std::vector<MatrixXd>{row}, VectorXd::Zero(1)),
                  {Shutter()});
  const auto report = graph.Covariance({{{Shutter(), 0, 1.0}}});
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().kind, ErrorKind::kCannotEstimate);
  EXPECT_EQ(report.error().message, "the information matrix is singular");
}

// As a match whose ray the lens has lost.
class WithoutValue : public ceres::SizedCostFunction<1, 2> {
 public:
  bool Evaluate(const double* const*, double*, double**) const override { return false; }
};

TEST(FactorGraph, AFactorWithoutValueIsAnErrorThatChangesNothing) {
  FactorGraph graph;
  graph.AddBlock(Shutter(), Euclidean(Eigen::Vector2d(1.0, -2.0)));
  graph.AddFactor(RandomNumbers(1).Factor(2, {2}), {Shutter()});
  graph.AddFactor(std::make_shared<WithoutValue>(), {Shutter()});
  const auto expect_error = [](const auto& result) {
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().kind, ErrorKind::kCannotEstimate);
    EXPECT_THAT(result.error().message, ::testing::HasSubstr("no value at the estimate"));
  };
  expect_error(graph.Covariance({{{Shutter(), 0, 1.0}}}));
  expect_error(graph.Linearize(AllKeys(graph)));
  expect_error(graph.Marginalize({Shutter()}));
  EXPECT_TRUE(graph.Has(Shutter()));
  EXPECT_EQ(graph.factors().size(), 2u);
  EXPECT_FALSE(graph.Solve({}).usable);
  EXPECT_EQ(VectorXd(graph.value(Shutter())), VectorXd(Eigen::Vector2d(1.0, -2.0)));
}

// Camera rotations against a turning gyro: rate groups of 4 samples, rotations over two groups.
FactorGraph RotationProblem(int groups) {
  RandomNumbers random(3);
  const Eigen::Quaterniond q_gyro_cam = Exp(Vector3d(0.4, -1.1, 0.7));
  FactorGraph graph;
  graph.AddBlock(Shutter(), Euclidean(Eigen::Vector2d(0.001, 0.0)));
  graph.AddBlock(
      Rotation(),
      {Geometry::kRotation, (q_gyro_cam * Exp(Vector3d(0.02, 0.03, -0.01))).coeffs(), {}});
  graph.AddBlock(Bias(0), Euclidean(Vector3d::Zero()));
  graph.AddFactor(
      std::make_shared<MarginalPrior>(
          std::vector<MarginalPrior::Block>{{Eigen::Vector2d::Zero()},
                                            {q_gyro_cam.coeffs(), MarginalPrior::Kind::kRotation},
                                            {Vector3d::Zero()}},
          MatrixXd((VectorXd(8) << 100, 1000, 5, 5, 5, 10, 10, 10).finished().asDiagonal()),
          VectorXd::Zero(8)),
      {Shutter(), Rotation(), Bias(0)});
  std::vector<double> times;
  Eigen::Matrix3Xd rates(3, 4 * groups);
  for (int i = 0; i < 4 * groups; ++i) {
    times.push_back(0.01 * i);
    rates.col(i) << std::sin(0.5 * i), 1.2 * std::cos(0.3 * i), 0.8 * std::sin(0.2 * i + 1.0);
  }
  const RotationChain chain(times, rates);
  for (int g = 0; g < groups; ++g) {
    const Eigen::Matrix3Xd noisy = rates.middleCols(4 * g, 4) + 0.01 * random.Matrix(3, 4);
    graph.AddBlock(Rates(g), Euclidean(Eigen::Map<const VectorXd>(noisy.data(), noisy.size())));
    graph.AddFactor(std::make_shared<GyroRate>(noisy, Vector3d::Constant(0.01)),
                    {Rates(g), Bias(0)});
    if (g == 0) continue;
    auto m = std::make_shared<PairMeasurement>();
    m->frame_a.stamp_s = times[static_cast<size_t>(4 * g - 4)] + 0.012;
    m->frame_b.stamp_s = times[static_cast<size_t>(4 * g)] + 0.022;
    m->q_a_b =
        Eigen::Quaterniond(q_gyro_cam.toRotationMatrix().transpose() *
                           chain.At(m->frame_a.stamp_s).R_ref_gyro.transpose() *
                           chain.At(m->frame_b.stamp_s).R_ref_gyro * q_gyro_cam.toRotationMatrix());
    m->q_a_b = m->q_a_b * Exp(Vector3d(0.002 * random.Vector(3)));
    m->sigma = 0.002;
    for (int i = 4 * g - 4; i < 4 * g + 4; ++i) m->rate_times_s.push_back(times[size_t(i)]);
    m->rate_group_sizes = {4, 4};
    graph.AddFactor(std::make_shared<RelativeRotation>(m),
                    {Shutter(), Rotation(), Rates(g - 1), Rates(g)});
  }
  return graph;
}

TEST(FactorGraph, NothingMovesAfterMarginalisingAtTheOptimum) {
  FactorGraph graph = RotationProblem(12);
  ASSERT_TRUE(graph.Solve(kToTheEnd).usable);
  const FactorGraph at_optimum = graph;
  for (int g = 0; g < 8; ++g) EXPECT_EQ(graph.Marginalize({Rates(g)}).value(), 0);
  std::vector<BlockId> stay;
  for (const auto& entry : graph.blocks()) stay.push_back(entry.first);
  EXPECT_EQ(stay.size(), 7u);

  // Linearised at the same point, so the covariance is that of the batch.
  const MatrixXd before = CovarianceOf(at_optimum, stay), after = CovarianceOf(graph, stay);
  EXPECT_LT((after - before).cwiseAbs().maxCoeff(), 1e-9 * before.diagonal().maxCoeff());

  const SolveReport report = graph.Solve(kToTheEnd);
  ASSERT_TRUE(report.usable);
  for (const BlockId& id : stay) {
    // To what the first solve left: its gradient tolerance, in sigmas.
    EXPECT_LT((graph.value(id) - at_optimum.value(id)).norm(), 1e-7) << static_cast<int>(id.kind);
  }
}

TEST(FactorGraph, BlockWithConstantCoordinatesSurvives) {
  const BlockId lens{BlockKind::kLens, 0};
  RandomNumbers random(11);
  const VectorXd start = random.Vector(8);
  FactorGraph graph;
  graph.AddBlock(lens, {Geometry::kEuclidean, start, {3, 5, 6, 7}});
  graph.AddBlock(Rates(0), Euclidean(random.Vector(3)));
  graph.AddBlock(Rates(1), Euclidean(random.Vector(3)));
  for (int i = 0; i < 2; ++i) graph.AddFactor(random.Factor(9, {8, 3}), {lens, Rates(i)});
  FactorGraph batch = graph;
  ASSERT_TRUE(batch.Solve(kToTheEnd).usable);
  EXPECT_EQ(graph.Marginalize({Rates(0)}).value(), 0);
  ASSERT_TRUE(graph.Has(lens));
  EXPECT_EQ(graph.block(lens).constant, (std::vector<int>{3, 5, 6, 7}));
  ASSERT_TRUE(graph.Solve(kToTheEnd).usable);
  for (const int c : {3, 5, 6, 7}) EXPECT_EQ(graph.value(lens)[c], start[c]);
  EXPECT_GT((graph.value(lens) - start).norm(), 1e-3);
  EXPECT_LT((graph.value(lens) - batch.value(lens)).norm(), 1e-9);
  EXPECT_LT((CovarianceOf(graph, {lens}) - CovarianceOf(batch, {lens})).norm(), 1e-9);
  // A block with all coordinates constant is neither solved for nor lost.
  FactorGraph fixed;
  fixed.AddBlock(Shutter(), {Geometry::kEuclidean, Eigen::Vector2d(0.3, 0.4), {0, 1}});
  fixed.AddBlock(Rates(0), Euclidean(random.Vector(3)));
  fixed.AddBlock(Rates(1), Euclidean(random.Vector(3)));
  fixed.AddFactor(random.Factor(7, {2, 3, 3}), {Shutter(), Rates(0), Rates(1)});
  FactorGraph whole = fixed;
  ASSERT_TRUE(whole.Solve(kToTheEnd).usable);
  EXPECT_EQ(fixed.Marginalize({Rates(0)}).value(), 0);
  ASSERT_TRUE(fixed.Solve(kToTheEnd).usable);
  EXPECT_EQ(fixed.value(Shutter()), VectorXd(Eigen::Vector2d(0.3, 0.4)));
  EXPECT_LT((fixed.value(Rates(1)) - whole.value(Rates(1))).norm(), 1e-8);
}

TEST(FactorGraph, OrphansAndSingleBlocksLeaveNothingBehind) {
  RandomNumbers random(12);
  FactorGraph graph;
  graph.AddBlock(Bias(0), Euclidean(random.Vector(3)));
  graph.AddBlock(Bias(1), Euclidean(random.Vector(3)));
  graph.AddBlock(Bias(2), Euclidean(random.Vector(3)));
  graph.AddFactor(random.Factor(5, {3}), {Bias(1)});
  graph.AddFactor(random.Factor(5, {3}), {Bias(2)});
  EXPECT_EQ(graph.Marginalize({Bias(0)}).value(), 0);  // no factor touches it
  EXPECT_EQ(graph.factors().size(), 2u);
  EXPECT_EQ(graph.Marginalize({Bias(1)}).value(), 0);  // a factor, but no neighbour
  EXPECT_EQ(graph.factors().size(), 1u);
  EXPECT_EQ(graph.blocks().size(), 1u);
  EXPECT_TRUE(graph.Has(Bias(2)));
}

TEST(FactorGraph, CountsWhatNoFactorDetermined) {
  RandomNumbers random(13);
  FactorGraph graph;
  graph.AddBlock(Bias(0), Euclidean(random.Vector(3)));
  graph.AddBlock(Bias(1), Euclidean(random.Vector(3)));
  graph.AddFactor(random.Factor(1, {3, 3}), {Bias(0), Bias(1)});
  graph.AddFactor(random.Factor(3, {3}), {Bias(1)});
  const MatrixXd before = CovarianceOf(
      [&] {
        FactorGraph alone;
        alone.AddBlock(Bias(1), Euclidean(random.Vector(3)));
        alone.AddFactor(std::prev(graph.factors().end())->second.cost, {Bias(1)});
        return alone;
      }(),
      {Bias(1)});
  EXPECT_EQ(graph.Marginalize({Bias(0)}).value(), 2);
  // The one row says nothing about the neighbour, once Bias(0) is free.
  EXPECT_LT((CovarianceOf(graph, {Bias(1)}) - before).norm(), 1e-9 * before.norm());
}

}  // namespace
}  // namespace camgyro
