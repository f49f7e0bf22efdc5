#include "estimator/diagnosis/pair_scores.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "estimator/diagnosis/pair_system.h"
#include "estimator/window/pair_graph.h"

namespace camgyro {
namespace {

void ProjectInto(const PairSystem& s, int num_model, PairScore* pair, BlockScore* block) {
  Eigen::MatrixXd A = s.N.transpose() * s.N;
  A.diagonal() += s.prior;
  A.diagonal().array() += 1e-9;
  const Eigen::LDLT<Eigen::MatrixXd> solver(A);
  const Eigen::MatrixXd NJ = s.N.transpose() * s.J;
  const Eigen::VectorXd Nr = s.N.transpose() * s.r + s.prior.cwiseProduct(s.at);
  const Eigen::MatrixXd X = solver.solve(NJ);
  const Eigen::VectorXd x = solver.solve(Nr);
  const Eigen::VectorXd g = s.J.transpose() * s.r - NJ.transpose() * x;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(s.J.cols(), s.J.cols());
  H.selfadjointView<Eigen::Lower>().rankUpdate(s.J.transpose());
  H.triangularView<Eigen::StrictlyUpper>() = H.transpose();
  H.noalias() -= NJ.transpose() * X;
  pair->chi2 = s.r.squaredNorm() + s.at.dot(s.prior.cwiseProduct(s.at)) - Nr.dot(x);
  if (s.times_column >= 0) {
    // log det(1 + s^2 W), W the information of the times with all else of the pair projected out:
    // they have a covariance of (W + s^-2)^-1.
    const Eigen::MatrixXd unit =
        Eigen::MatrixXd::Identity(s.N.cols(), s.N.cols()).middleCols<2>(s.times_column);
    const Eigen::Matrix2d covariance = solver.solve(unit).middleRows<2>(s.times_column);
    pair->log_det = -std::log(covariance.determinant() * s.prior.segment<2>(s.times_column).prod());
  }
  pair->g = g;
  pair->H = H.topLeftCorner(num_model, num_model);
  block->g += g;
  block->H += H;
  block->chi2 += pair->chi2;
  block->log_det += pair->log_det;
  block->residuals += pair->residuals;
  ++block->pairs;
  if (s.bend_column < 0) return;

  // Likelihood of two widths of the bend, all else of the pair projected out: with u the bend's
  // score and W its information, 2 log L(s) = u (W + s^-2)^-1 u - log det(1 + s^2 W).
  const Eigen::Index at = s.bend_column, n = s.N.cols();
  Eigen::VectorXd wide = s.prior;
  wide.segment<6>(at) = s.free_bend;
  const auto two_log = [&](const Eigen::VectorXd& prior) {
    Eigen::MatrixXd B = s.N.transpose() * s.N;
    B.diagonal() += prior;
    B.diagonal().array() += 1e-9;
    const Eigen::LDLT<Eigen::MatrixXd> factor(B);
    double log_det = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) log_det += std::log(factor.vectorD()[i]);
    const Eigen::VectorXd b = s.N.transpose() * s.r + prior.cwiseProduct(s.at);
    return b.dot(factor.solve(b)) - s.at.dot(prior.cwiseProduct(s.at)) - log_det +
           prior.segment<6>(at).array().log().sum();
  };
  pair->latent_gain = two_log(wide) - two_log(s.prior);
}

}  // namespace

Scores ComputeScores(const EstimationInput& input, const std::vector<PairBlock>& blocks,
                     const Calibration& calibration, std::shared_ptr<const EffectSet> candidates,
                     double noise, const PairGraphOptions& options) {
  const AllEffects all = AllEffectsOf(calibration, candidates.get());
  Scores scores;
  scores.num_model = kStateSize + static_cast<int>(calibration.effect_values.size());
  const Eigen::Index size = kStateSize + all.set->size();
  std::vector<BlockScore> sums(blocks.size());
  std::vector<std::vector<PairScore>> pairs(blocks.size());
  ParallelFor(blocks.size(), [&](size_t b) {
    const PairBlock& block = blocks[b];
    BlockScore& sum = sums[b];
    sum.g.setZero(size);
    sum.H.setZero(size, size);
    if (!block.empty()) sum.time_s = 0.5 * (block.front().time_a_s + block.back().time_b_s);
    for (const TimedPair& pair : block) {
      PairSystem system;
      if (!MakePairSystem(input, pair, calibration, all, noise, options, &system)) continue;
      PairScore score;
      score.frame_b = pair.frame_b;
      score.time_s = pair.time_b_s;
      // The direction takes two; the bend none, since chi2 has the penalty of its prior.
      score.residuals = static_cast<int>(system.r.size()) -
                        (ResidualOf(pair, options).facts().has_direction ? 2 : 0);
      ProjectInto(system, scores.num_model, &score, &sum);
      pairs[b].push_back(std::move(score));
    }
  });
  for (size_t b = 0; b < blocks.size(); ++b) {
    if (sums[b].pairs == 0) continue;
    for (PairScore& score : pairs[b]) {
      score.block = static_cast<int>(scores.blocks.size());
      scores.pairs.push_back(std::move(score));
    }
    scores.blocks.push_back(std::move(sums[b]));
  }
  return scores;
}

std::vector<double> LatentGain(const Scores& scores) {
  std::vector<double> gain(scores.blocks.size(), 0.0);
  for (const PairScore& pair : scores.pairs) {
    gain[static_cast<size_t>(pair.block)] += pair.latent_gain;
  }
  return gain;
}

}  // namespace camgyro
