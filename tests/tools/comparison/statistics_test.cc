// Numbers of a comparison, from runs whose statistics are known.
#include "tools/comparison/statistics.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "tools/comparison/comparison_report.h"
#include "tools/comparison/error_plot.h"

namespace camgyro::comparison {
namespace {

using testing::Each;
using testing::HasSubstr;
using testing::Not;

StateCovariance SomeCovariance() {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  StateCovariance L = StateCovariance::Zero();
  for (int i = 0; i < kStateSize; ++i) {
    for (int k = 0; k <= i; ++k) L(i, k) = normal(random);
    L(i, i) += 3.0;
  }
  // Units that differ by orders of magnitude, as in life.
  StateVector units = StateVector::Constant(1e-3);
  units.head<3>().setConstant(2.0);
  return units.asDiagonal() * (L * L.transpose()) * units.asDiagonal();
}

// Errors drawn from `covariance`; the estimator claims claimed * covariance.
std::vector<SeedRun> DrawRuns(int count, const StateCovariance& covariance, double claimed) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const StateCovariance L = covariance.llt().matrixL();
  std::vector<SeedRun> runs;
  for (int i = 0; i < count; ++i) {
    StateVector white;
    for (int k = 0; k < kStateSize; ++k) white[k] = normal(random);
    SeedRun run;
    run.estimators.resize(1);
    EstimatorRun& e = run.estimators[0];
    e.estimator = "window";
    e.error = L * white;
    e.covariance = claimed * covariance;
    e.frames = 100;
    e.cpu_s = 0.2;
    e.memory_mb = 5.0 + i % 3;
    e.trace = {{10, 100.0 * e.error, e.error.cwiseAbs()}, {99, e.error, e.covariance.diagonal()}};
    e.trace.back().sigma = e.covariance.diagonal().cwiseSqrt();
    run.bound = {4.0 * covariance, covariance};
    runs.push_back(run);
  }
  return runs;
}

TEST(Statistics, HonestEstimatorIsAtOne) {
  const StateCovariance covariance = SomeCovariance();
  const EstimatorStatistics s = Summarize(DrawRuns(200, covariance, 1.0), 0);
  EXPECT_EQ(s.runs, 200);
  EXPECT_EQ(s.failed, 0);
  // The mean of 200 x chi2_11 / 11 has a standard deviation of sqrt(2 / 2200) = 0.03.
  EXPECT_NEAR(s.nees, 1.0, 0.1);
  EXPECT_LT(s.nees_low, s.nees);
  EXPECT_GT(s.nees_high, s.nees);
  EXPECT_NEAR(s.nees_high - s.nees_low, 2 * 1.96 * 0.030, 0.03);
  EXPECT_GT(s.within_3_sigma, 0.99);
  EXPECT_NEAR(s.ms_per_frame, 2.0, 1e-9);
  EXPECT_EQ(s.memory_mb, 7.0);
  for (int i = 0; i < kStateSize; ++i) {
    const ParameterStatistics& p = s.parameters[static_cast<size_t>(i)];
    const double sigma = std::sqrt(covariance(i, i));
    EXPECT_NEAR(p.rmse / sigma, 1.0, 0.2);  // 4 standard deviations of 1/sqrt(400)
    EXPECT_NEAR(p.bound / sigma, 1.0, 1e-9);
    EXPECT_NEAR(p.sigma / sigma, 1.0, 1e-9);
    EXPECT_LT(std::abs(p.bias_sigmas), 4.0 / std::sqrt(200.0));
  }
}

TEST(Statistics, OverConfidenceShows) {
  const EstimatorStatistics s = Summarize(DrawRuns(50, SomeCovariance(), 1.0 / 16.0), 0);
  EXPECT_NEAR(s.nees, 16.0, 3.0);
  EXPECT_GT(s.nees_low, 10.0);
  // Within 3 claimed sigmas is within 0.75 true ones: 55 % of a Gaussian.
  EXPECT_NEAR(s.within_3_sigma, 0.547, 0.08);
}

TEST(Statistics, BiasIsTheMeanInSigmas) {
  std::vector<SeedRun> runs = DrawRuns(4, SomeCovariance(), 1.0);
  for (size_t i = 0; i < 4; ++i) {
    EstimatorRun& e = runs[i].estimators[0];
    e.covariance.setIdentity();
    e.error.setConstant(i % 2 == 0 ? 1.0 : 2.0);
  }
  const ParameterStatistics p = Summarize(runs, 0).parameters[0];
  EXPECT_NEAR(p.bias_sigmas, 1.5, 1e-12);
  EXPECT_NEAR(p.rmse, std::sqrt(2.5), 1e-12);
  EXPECT_EQ(p.within_3_sigma, 1.0);
}

TEST(Statistics, ConvergedIsForGood) {
  std::vector<SeedRun> runs = DrawRuns(1, SomeCovariance(), 1.0);
  EstimatorRun& e = runs[0].estimators[0];
  const auto point = [](int frame, double error, double sigma) {
    return TracePoint{frame, StateVector::Constant(error), StateVector::Constant(sigma)};
  };
  // 3 x the final sigma is 3: in at 20, out again at 30, in from 40 on.
  e.trace = {point(10, 9, 5), point(20, 2, 4), point(30, -4, 3), point(40, 1, 2), point(50, 2, 1)};
  EXPECT_EQ(Summarize(runs, 0).parameters[0].frames_to_converge, 40.0);
  e.trace.back().error.setConstant(3.5);
  EXPECT_TRUE(std::isnan(Summarize(runs, 0).parameters[0].frames_to_converge));
  e.trace.clear();  // the refinement has none
  EXPECT_TRUE(std::isnan(Summarize(runs, 0).parameters[0].frames_to_converge));
}

TEST(Statistics, FailedRunsAreCountedAndLeftOut) {
  std::vector<SeedRun> runs = DrawRuns(5, SomeCovariance(), 1.0);
  runs[1].estimators[0].failure = "no pair of frames could be used";
  runs[1].estimators[0].error.setConstant(1e9);
  EstimatorStatistics s = Summarize(runs, 0);
  EXPECT_EQ(s.runs, 4);
  EXPECT_EQ(s.failed, 1);
  EXPECT_THAT(s.failures, testing::ElementsAre("no pair of frames could be used"));
  EXPECT_LT(s.nees, 5.0);
  for (SeedRun& run : runs) run.estimators[0].failure = "x";
  s = Summarize(runs, 0);
  EXPECT_EQ(s.runs, 0);
  EXPECT_THAT(CaseTable({"walking", 0.5, runs, {s}}), HasSubstr("5 failed\n             (x)"));
}

TEST(Statistics, IntervalNeedsThreeRuns) {
  EXPECT_TRUE(std::isnan(Summarize(DrawRuns(2, SomeCovariance(), 1.0), 0).nees_low));
}

TEST(SeedRun, SurvivesItsBytes) {
  std::vector<SeedRun> runs = DrawRuns(1, SomeCovariance(), 1.0);
  runs[0].estimators.push_back(runs[0].estimators[0]);
  runs[0].estimators[1].failure = "why";
  runs[0].estimators[1].trace.clear();
  const SeedRun back = Unpack(Pack(runs[0]));
  ASSERT_EQ(back.estimators.size(), 2u);
  EXPECT_EQ(back.estimators[0].estimator, "window");
  EXPECT_EQ(back.estimators[0].error, runs[0].estimators[0].error);
  EXPECT_EQ(back.estimators[0].covariance, runs[0].estimators[0].covariance);
  ASSERT_EQ(back.estimators[0].trace.size(), 2u);
  EXPECT_EQ(back.estimators[0].trace[1].frame, 99);
  EXPECT_EQ(back.estimators[0].trace[1].sigma, runs[0].estimators[0].trace[1].sigma);
  EXPECT_EQ(back.estimators[0].memory_mb, 5.0);
  EXPECT_EQ(back.estimators[1].failure, "why");
  ASSERT_EQ(back.bound.size(), 2u);
  EXPECT_EQ(back.bound[1], runs[0].bound[1]);
}

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(ErrorPlot, HasAPanelPerParameterAndALinePerEstimator) {
  SeedRun run = DrawRuns(1, SomeCovariance(), 1.0)[0];
  run.estimators.push_back(run.estimators[0]);
  run.estimators[1].estimator = "ekf";
  run.estimators.push_back(run.estimators[0]);
  run.estimators[2].estimator = "refinement";
  run.estimators[2].trace.clear();
  run.estimators.push_back(run.estimators[0]);
  run.estimators[3].failure = "not drawn";
  const std::string svg = ErrorPlotSvg("walking", run);
  EXPECT_THAT(svg, testing::StartsWith("<svg xmlns="));
  EXPECT_THAT(svg, testing::EndsWith("</svg>\n"));
  EXPECT_EQ(Count(svg, "<rect "), 1 + kStateSize);
  // Error and both limits of two estimators, and both limits of the bound.
  EXPECT_EQ(Count(svg, "<polyline "), kStateSize * (2 * 3 + 2));
  EXPECT_EQ(Count(svg, "<polygon "), kStateSize * 2);
  EXPECT_EQ(Count(svg, "<circle "), kStateSize + 1);  // and in the legend
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
  EXPECT_THAT(svg, HasSubstr("bound: ±3 sigma"));
}

}  // namespace
}  // namespace camgyro::comparison
