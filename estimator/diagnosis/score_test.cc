#include "estimator/diagnosis/score_test.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <unsupported/Eigen/SpecialFunctions>
#include <utility>

#include "core/linear_algebra.h"
#include "estimator/diagnosis/thresholds.h"

namespace camgyro {
namespace {

Eigen::VectorXd Pick(const Eigen::VectorXd& v, const std::vector<int>& at) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(at.size()));
  for (size_t i = 0; i < at.size(); ++i) out[static_cast<Eigen::Index>(i)] = v[at[i]];
  return out;
}

Eigen::MatrixXd Pick(const Eigen::MatrixXd& m, const std::vector<int>& rows,
                     const std::vector<int>& cols) {
  Eigen::MatrixXd out(rows.size(), cols.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    for (size_t j = 0; j < cols.size(); ++j) {
      out(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = m(rows[i], cols[j]);
    }
  }
  return out;
}

struct Sum {
  Eigen::VectorXd g;
  Eigen::MatrixXd H;
};

Sum SumBlocks(const Scores& scores) {
  Sum sum{scores.blocks.front().g, scores.blocks.front().H};
  for (size_t i = 1; i < scores.blocks.size(); ++i) {
    sum.g += scores.blocks[i].g;
    sum.H += scores.blocks[i].H;
  }
  return sum;
}

std::vector<int> ModelColumns(const Scores& scores) {
  std::vector<int> model(static_cast<size_t>(scores.num_model));
  for (int i = 0; i < scores.num_model; ++i) model[static_cast<size_t>(i)] = i;
  return model;
}

// Score, information and residual scores by block of `columns`, the model's projected out.
struct Effective {
  Eigen::VectorXd s;
  Eigen::MatrixXd M;
  Eigen::MatrixXd X;  // model x columns
  Eigen::VectorXd estimate;
  std::vector<Eigen::VectorXd> rest;   // scores that the fitted columns leave, by block
  std::vector<Eigen::VectorXd> pairs;  // scores by pair
};

Effective Project(const Scores& scores, const std::vector<int>& columns,
                  const Eigen::VectorXd& prior_information) {
  const Sum sum = SumBlocks(scores);
  const std::vector<int> model = ModelColumns(scores);
  Eigen::MatrixXd H_mm = Pick(sum.H, model, model);
  H_mm.diagonal() += Pick(prior_information, model);
  const SymmetricSolver model_solver(H_mm, kSmallRidge);
  const Eigen::MatrixXd H_mc = Pick(sum.H, model, columns);
  Effective e;
  e.X = model_solver.Solve(H_mc);
  const Eigen::MatrixXd& X = e.X;
  const Eigen::VectorXd g_m = Pick(sum.g, model);
  e.s = Pick(sum.g, columns) - X.transpose() * g_m;
  e.M = Pick(sum.H, columns, columns) - H_mc.transpose() * X;
  e.M = 0.5 * (e.M + e.M.transpose()).eval();
  Eigen::MatrixXd with_prior = e.M;
  with_prior.diagonal() += Pick(prior_information, columns);
  e.estimate = -SymmetricSolver(with_prior, kSmallRidge).Solve(e.s);
  const Eigen::VectorXd model_step = -model_solver.Solve(g_m + H_mc * e.estimate);
  for (const BlockScore& block : scores.blocks) {
    const Eigen::VectorXd left_m = Pick(block.g, model) + Pick(block.H, model, model) * model_step +
                                   Pick(block.H, model, columns) * e.estimate;
    const Eigen::VectorXd left_c = Pick(block.g, columns) +
                                   Pick(block.H, columns, model) * model_step +
                                   Pick(block.H, columns, columns) * e.estimate;
    e.rest.push_back(left_c - X.transpose() * left_m);
  }
  for (const PairScore& pair : scores.pairs) {
    if (pair.g.size() != sum.g.size()) break;  // the caller has no scores by pair
    e.pairs.push_back(Pick(pair.g, columns) - X.transpose() * Pick(pair.g, model));
  }
  return e;
}

ScoreTest Judge(const Effective& e, const Eigen::VectorXd& prior, const Scatter& usual) {
  ScoreTest test;
  // Directions with information beyond the prior's.
  const Eigen::VectorXd scale = prior.cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  const SymmetricSpectrum eigen =
      SpectrumOfSymmetric(scale.asDiagonal() * e.M * scale.asDiagonal());
  std::vector<Eigen::VectorXd> directions;  // whitening
  for (Eigen::Index i = 0; i < eigen.values.size(); ++i) {
    const double value = eigen.values[i];
    if (value > kLeastInformation) {
      directions.emplace_back(scale.cwiseProduct(eigen.vectors.col(i)) / std::sqrt(value));
    }
  }
  test.dof = static_cast<int>(directions.size());
  test.estimate = e.estimate;
  if (test.dof == 0 || e.rest.size() < kLeastBlocks) {
    test.dof = 0;
    test.covariance = Eigen::MatrixXd::Zero(prior.size(), prior.size());
    return test;
  }
  double chi2 = 0.0, scatter = 0.0, pair_scatter = 0.0;
  for (const Eigen::VectorXd& direction : directions) {
    const double z = direction.dot(e.s);
    chi2 += z * z;
    for (const Eigen::VectorXd& rest : e.rest) {
      const double part = direction.dot(rest);
      scatter += part * part;
    }
    for (const Eigen::VectorXd& pair : e.pairs) {
      const double part = direction.dot(pair);
      pair_scatter += part * part;
    }
  }
  const double free = static_cast<double>(e.rest.size()) - 1.0;
  // Each direction took one degree of freedom from the sum of the blocks' rests.
  // (Columns that live in one block leave nothing there: for them the pairs count.)
  test.scatter = {scatter / test.dof * (free + 1.0) / free, test.dof * free};
  const double dof = test.scatter.dof + usual.dof;
  const double moderated =
      (test.scatter.variance * test.scatter.dof + usual.variance * usual.dof) / dof;
  test.inflation = std::max({1.0, moderated, pair_scatter / test.dof});
  test.statistic = chi2 / test.inflation;
  test.p_value = FTail(test.statistic / test.dof, test.dof, dof);
  Eigen::MatrixXd with_prior = e.M / test.inflation;
  with_prior.diagonal() += prior;
  test.covariance = SymmetricSolver(with_prior).Inverse();
  return test;
}

}  // namespace

Scores FirstColumns(Scores scores, Eigen::Index columns) {
  for (BlockScore& block : scores.blocks) {
    block.g.conservativeResize(columns);
    block.H.conservativeResize(columns, columns);
  }
  for (PairScore& pair : scores.pairs) pair.g.conservativeResize(columns);
  return scores;
}

Scores MergeShares(Scores first, Scores second) {
  const size_t of_first = first.blocks.size();
  std::vector<BlockScore> blocks = std::move(first.blocks);
  std::move(second.blocks.begin(), second.blocks.end(), std::back_inserter(blocks));
  Scores both;
  both.num_model = first.num_model;
  both.pairs = std::move(first.pairs);
  std::vector<size_t> order(blocks.size()), rank(blocks.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](size_t i, size_t j) { return blocks[i].time_s < blocks[j].time_s; });
  for (size_t k = 0; k < order.size(); ++k) {
    BlockScore& block = blocks[order[k]];
    rank[order[k]] = k / 2;
    if (k % 2 == 0) {
      both.blocks.push_back(std::move(block));
      continue;
    }
    BlockScore& sum = both.blocks.back();
    sum.pairs += block.pairs;
    sum.residuals += block.residuals;
    sum.chi2 += block.chi2;
    sum.log_det += block.log_det;
    sum.g += block.g;
    sum.H += block.H;
  }
  for (PairScore& pair : both.pairs) {
    pair.block = static_cast<int>(rank[static_cast<size_t>(pair.block)]);
  }
  for (PairScore& pair : second.pairs) {
    pair.block = static_cast<int>(rank[of_first + static_cast<size_t>(pair.block)]);
    both.pairs.push_back(std::move(pair));
  }
  std::sort(both.pairs.begin(), both.pairs.end(),
            [](const PairScore& a, const PairScore& b) { return a.time_s < b.time_s; });
  return both;
}

double ChiSquareTail(double value, double dof) {
  const Eigen::Array<double, 1, 1> a(0.5 * dof), x(0.5 * std::max(0.0, value));
  return Eigen::igammac(a, x)(0);
}

double FTail(double value, double dof1, double dof2) {
  // Q = I_{d2 / (d2 + d1 F)}(d2 / 2, d1 / 2)
  const Eigen::Array<double, 1, 1> a(0.5 * dof2), b(0.5 * dof1),
      x(dof2 / (dof2 + dof1 * std::max(0.0, value)));
  return Eigen::betainc(a, b, x)(0);
}

ScoreTest TestColumns(const Scores& scores, const std::vector<int>& columns,
                      const Eigen::VectorXd& prior_information, const Scatter& usual) {
  if (scores.blocks.size() < kLeastBlocks) return {};
  return Judge(Project(scores, columns, prior_information), Pick(prior_information, columns),
               usual);
}

Projection ProjectModelOut(const Scores& scores, const std::vector<int>& columns,
                           const Eigen::VectorXd& prior_information) {
  Effective e = Project(scores, columns, prior_information);
  return {std::move(e.s), std::move(e.M), std::move(e.X)};
}

Scatter UsualScatter(const std::vector<ScoreTest>& tests) {
  const auto digamma = [](double x) { return Eigen::numext::digamma(x); };
  const auto trigamma = [](double x) { return Eigen::numext::polygamma(1.0, x); };
  // log of a variance, without what the finite degrees of freedom shift it by
  std::vector<double> logs;
  double own_variance = 0.0;
  for (const ScoreTest& test : tests) {
    if (test.dof == 0 || test.scatter.variance <= 0.0) continue;
    const double half = 0.5 * test.scatter.dof;
    logs.push_back(std::log(test.scatter.variance) - digamma(half) + std::log(half));
    own_variance += trigamma(half);
  }
  if (logs.size() < 3) return {};
  const auto n = static_cast<double>(logs.size());
  const double mean = std::accumulate(logs.begin(), logs.end(), 0.0) / n;
  double variance = -own_variance / n;
  for (const double log : logs) variance += (log - mean) * (log - mean) / (n - 1.0);
  // trigamma falls from infinity to zero: its inverse by bisection
  double low = 0.01, high = 0.5 * kMostScatterDof;
  for (int i = 0; i < 60; ++i) {
    const double half = 0.5 * (low + high);
    (trigamma(half) > variance ? low : high) = half;
  }
  return {std::exp(mean + digamma(high) - std::log(high)), 2.0 * high};
}

Eigen::VectorXd StepOf(const Scores& scores, const std::vector<int>& columns,
                       const Eigen::VectorXd& prior_information) {
  const Sum sum = SumBlocks(scores);
  std::vector<int> free = ModelColumns(scores);
  free.insert(free.end(), columns.begin(), columns.end());
  Eigen::MatrixXd H = Pick(sum.H, free, free);
  H.diagonal() += Pick(prior_information, free);
  const Eigen::VectorXd x = -SymmetricSolver(H, kSmallRidge).Solve(Pick(sum.g, free));
  Eigen::VectorXd step = Eigen::VectorXd::Zero(sum.g.size());
  for (size_t i = 0; i < free.size(); ++i) step[free[i]] = x[static_cast<Eigen::Index>(i)];
  return step;
}

Gain SumOf(const std::vector<double>& gain_by_block) {
  Gain gain;
  const auto n = static_cast<double>(gain_by_block.size());
  for (const double g : gain_by_block) {
    gain.sum += g;
    gain.lost += std::max(0.0, -g);
  }
  double variance = 0.0;
  for (const double g : gain_by_block) variance += (g - gain.sum / n) * (g - gain.sum / n);
  gain.sigma = n > 1.0 ? std::sqrt(variance * n / (n - 1.0)) : 0.0;
  return gain;
}

std::vector<double> GainOfStep(const Scores& scores, const Eigen::VectorXd& step) {
  std::vector<double> gains;
  for (const BlockScore& block : scores.blocks) {
    gains.push_back(-2.0 * block.g.dot(step) - step.dot(block.H * step));
  }
  return gains;
}

std::vector<double> GainAcross(const Scores& first, const Scores& second,
                               const std::vector<int>& columns,
                               const Eigen::VectorXd& prior_information) {
  std::vector<double> gains = GainOfStep(second, StepOf(first, columns, prior_information));
  const std::vector<double> of_first =
      GainOfStep(first, StepOf(second, columns, prior_information));
  gains.insert(gains.end(), of_first.begin(), of_first.end());
  for (double& gain : gains) gain *= 0.5;
  return gains;
}

double AliasOf(const Scores& scores, const std::vector<int>& first, const std::vector<int>& second,
               const Eigen::VectorXd& prior_information) {
  std::vector<int> both = first;
  both.insert(both.end(), second.begin(), second.end());
  const Effective e = Project(scores, both, prior_information);
  const auto n = static_cast<Eigen::Index>(first.size());
  const Eigen::Index m = e.M.cols() - n;
  Eigen::MatrixXd A = e.M.topLeftCorner(n, n), B = e.M.bottomRightCorner(m, m);
  A.diagonal() += Pick(prior_information, first);
  B.diagonal() += Pick(prior_information, second);
  // Canonical correlations: singular values of A^-1/2 C B^-1/2.
  const Eigen::MatrixXd C = InverseRoot(A) * e.M.topRightCorner(n, m) * InverseRoot(B).transpose();
  if (C.size() == 1) return C(0, 0);
  return LargestSingularValue(C);
}

}  // namespace camgyro
