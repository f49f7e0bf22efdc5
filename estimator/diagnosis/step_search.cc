#include "estimator/diagnosis/step_search.h"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/thresholds.h"

namespace camgyro {
namespace {

// Of the delay's score between blocks, once the model and a step (a column) are fitted. The scores
// of the step's own column say little of a step near an end: few blocks have it.
Scatter DelayScatter(const Scores& scores, int step, Eigen::VectorXd prior_information) {
  prior_information[step] = 0.0;  // a prior leaves some of a step
  const Eigen::VectorXd fitted = StepOf(scores, {step}, prior_information);
  double scatter = 0.0;
  for (const BlockScore& block : scores.blocks) {
    const double left = block.g[kStateDelay] + block.H.row(kStateDelay).dot(fitted);
    scatter += left * left / std::max(1e-30, block.H(kStateDelay, kStateDelay));
  }
  const double free = static_cast<double>(scores.blocks.size()) - 2.0;  // delay and step
  return {scatter / free, free};
}

}  // namespace

StepSearch SearchDelayStep(const Scores& scores, const Eigen::VectorXd& prior_information,
                           double margin_s, const Scatter& usual) {
  StepSearch best;
  if (scores.blocks.size() < kLeastBlocks || scores.pairs.empty()) return best;
  // A column for the step: the delay's own, for the pairs after it.
  Scores extended;
  extended.num_model = scores.num_model;
  const Eigen::Index n = scores.num_model;
  for (const BlockScore& block : scores.blocks) {
    BlockScore wide;
    wide.g = Eigen::VectorXd::Zero(n + 1);
    wide.H = Eigen::MatrixXd::Zero(n + 1, n + 1);
    wide.g.head(n) = block.g.head(n);
    wide.H.topLeftCorner(n, n) = block.H.topLeftCorner(n, n);
    extended.blocks.push_back(std::move(wide));
  }
  Eigen::VectorXd prior(n + 1);
  prior << prior_information.head(n), 1.0 / (kStepPriorS * kStepPriorS);
  const double first_s = scores.pairs.front().time_s, last_s = scores.pairs.back().time_s;
  double first_used_s = last_s, last_used_s = first_s;
  double best_chi2 = 0.0;  // before inflation, which changes with the time of the step
  Scores stepped;
  for (size_t i = scores.pairs.size(); i-- > 0;) {
    const PairScore& pair = scores.pairs[i];
    BlockScore& block = extended.blocks[static_cast<size_t>(pair.block)];
    block.g[n] += pair.g[kStateDelay];
    block.H.col(n).head(n) += pair.H.col(kStateDelay);
    block.H.row(n).head(n) = block.H.col(n).head(n).transpose();
    block.H(n, n) += pair.H(kStateDelay, kStateDelay);
    if (pair.time_s < first_s + margin_s || pair.time_s > last_s - margin_s) continue;
    first_used_s = std::min(first_used_s, pair.time_s);
    last_used_s = std::max(last_used_s, pair.time_s);
    const ScoreTest test = TestColumns(extended, {static_cast<int>(n)}, prior, usual);
    if (test.dof == 1 && test.statistic * test.inflation > best_chi2) {
      best_chi2 = test.statistic * test.inflation;
      best.test = test;
      best.time_s = pair.time_s;
      best.frame = pair.frame_b;
      stepped.num_model = extended.num_model;
      stepped.blocks = extended.blocks;
    }
  }
  if (best.test.dof == 1 && last_used_s > first_used_s) {
    const Scatter scatter = DelayScatter(stepped, static_cast<int>(n), prior);
    const double dof = scatter.dof + usual.dof;
    best.test.inflation = std::max(
        best.test.inflation, (scatter.variance * scatter.dof + usual.variance * usual.dof) / dof);
    best.test.statistic = best_chi2 / best.test.inflation;
    best.test.p_value = FTail(best.test.statistic, 1.0, dof);
    const double duration = last_s - first_s;
    const double e1 = (first_used_s - first_s) / duration, e2 = (last_s - last_used_s) / duration;
    const double log_lambda = std::log((1.0 - e1) * (1.0 - e2) / std::max(1e-6, e1 * e2));
    const double x = best.test.statistic;
    const double sup =
        std::sqrt(x / (2.0 * M_PI)) * std::exp(-0.5 * x) * ((1.0 - 1.0 / x) * log_lambda + 4.0 / x);
    // The same number of searches as the formula has for the normal distribution, with F's tail.
    best.test.p_value =
        std::min(1.0, std::max(1.0, sup / ChiSquareTail(x, 1.0)) * best.test.p_value);
  }
  return best;
}

ScoreTest TestDelayOfPairs(const Scores& scores, const Eigen::VectorXd& prior_information) {
  ScoreTest test;
  const auto n = static_cast<Eigen::Index>(scores.pairs.size());
  test.estimate = Eigen::VectorXd::Zero(n);
  test.covariance = Eigen::MatrixXd::Zero(n, 1);
  double scatter = 0.0, other = 0.0;
  int count = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const PairScore& pair = scores.pairs[static_cast<size_t>(i)];
    const double information = pair.H(kStateDelay, kStateDelay);
    const double s = pair.g[kStateDelay];
    const double prior = prior_information[kStateDelay];
    test.estimate[i] = -s / (information + prior);
    test.covariance(i, 0) = 1.0 / std::sqrt(information + prior);
    if (information < prior || pair.H(kStateFocal, kStateFocal) <= 0.0) continue;
    scatter += s * s / information;
    other += pair.g[kStateFocal] * pair.g[kStateFocal] / pair.H(kStateFocal, kStateFocal);
    ++count;
  }
  test.dof = count;
  if (count == 0) return test;
  test.inflation = std::max(1.0, other / count);
  test.statistic = scatter / test.inflation;
  test.p_value = ChiSquareTail(test.statistic, count);
  return test;
}

}  // namespace camgyro
