// Does an effect that the model lacks show in frames that the fit has not seen?
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_SCORE_TEST_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_SCORE_TEST_H_

#include <Eigen/Core>
#include <vector>

#include "estimator/diagnosis/pair_scores.h"

namespace camgyro {

Scores FirstColumns(Scores scores, Eigen::Index columns);
// Two shares with the same columns as one, pairs in the order of time. Two blocks that follow each
// other become one: what wanders slowly is alike in neighbours, and blocks are to scatter
// independently.
Scores MergeShares(Scores first, Scores second);

// Variance of the scores between blocks over what the noise lets expect, and how many degrees of
// freedom that knowledge is worth.
struct Scatter {
  double variance = 1.0, dof = 0.0;
};

// Score (Lagrange multiplier) test of some columns, the model's own columns projected out.
struct ScoreTest {
  // chi-square of the columns over the inflation; F-distributed times `dof` under the model.
  double statistic = 0.0;
  int dof = 0;
  double p_value = 1.0;
  // Variance of the scores between blocks over what the noise lets expect, at least 1: what
  // correlation within a block, outliers and unmodelled jitter make of it.
  double inflation = 1.0;
  Scatter scatter;           // of these columns alone
  Eigen::VectorXd estimate;  // one Gauss-Newton step from zero
  Eigen::MatrixXd covariance;
};

// `columns`: indices into BlockScore::g. prior_information: of the model's columns (1 / sigma^2 of
// their priors), and of the tested ones. usual: what the inflation is expected to be; a recording
// has a dozen or two of blocks, which alone leave the tail of F too heavy to tell small effects.
ScoreTest TestColumns(const Scores& scores, const std::vector<int>& columns,
                      const Eigen::VectorXd& prior_information, const Scatter& usual = {});

// What the scatters of many tests on the same blocks have in common (Smyth, "Linear models and
// empirical Bayes methods", 2004, section 6.2: log variances that differ by more than their own
// degrees of freedom allow are worth less). dof is at most 50, since the tests are not independent.
Scatter UsualScatter(const std::vector<ScoreTest>& tests);

// What some columns, left out of the model, do to its fit.
struct Projection {
  Eigen::VectorXd score;        // of the columns, the model's projected out
  Eigen::MatrixXd information;  // the same
  // Model x columns: how far a fit without the columns is off, by each column's true value.
  Eigen::MatrixXd shift;
};
Projection ProjectModelOut(const Scores& scores, const std::vector<int>& columns,
                           const Eigen::VectorXd& prior_information);

// Change of all columns by one Gauss-Newton step with some columns free beside the model's; the
// others stay zero.
Eigen::VectorXd StepOf(const Scores& scores, const std::vector<int>& columns,
                       const Eigen::VectorXd& prior_information);

// Sum over blocks of a gain, and its standard deviation from the scatter between blocks.
struct Gain {
  double sum = 0.0, sigma = 0.0;
  double lost = 0.0;  // of the blocks that lose, as a positive number
};
Gain SumOf(const std::vector<double>& gain_by_block);

// Fall of chi2 in each block if the parameters change by `step`.
std::vector<double> GainOfStep(const Scores& scores, const Eigen::VectorXd& step);

// Of each share of the data by the other's step (StepOf), by block, those of `second` first.
// Halved, to compare with a gain in one of them.
std::vector<double> GainAcross(const Scores& first, const Scores& second,
                               const std::vector<int>& columns,
                               const Eigen::VectorXd& prior_information);

// Cosine between two effects: correlation of their estimates' directions after the model's
// columns are projected out (canonical, the largest; with its sign if both have one parameter);
// near 1 or -1: this motion cannot tell them apart.
double AliasOf(const Scores& scores, const std::vector<int>& first, const std::vector<int>& second,
               const Eigen::VectorXd& prior_information);

// Upper tails.
double ChiSquareTail(double value, double dof);
double FTail(double value, double dof1, double dof2);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_SCORE_TEST_H_
