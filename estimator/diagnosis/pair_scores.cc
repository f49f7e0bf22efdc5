#include "estimator/diagnosis/pair_scores.h"

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/linear_algebra.h"
#include "core/parallel.h"
#include "estimator/diagnosis/pair_system.h"
#include "estimator/window/pair_graph.h"

namespace camgyro {
namespace {

// A pair's equations with what is its own projected out, but for the frames' own times, which it
// shares with the pairs before and after it. MakePairSystem linearises each pair at the times that
// its own matches tell; here these are the stamps, for all pairs alike.
struct PairAlone {
  std::array<int, 2> frames = {0, 0};
  Eigen::Vector2d frame_time_prior = Eigen::Vector2d::Zero();  // 1 / s^2, of either frame
  double chi2 = 0.0;
  Eigen::VectorXd g;
  Eigen::MatrixXd H;
  // By the two times: their own score and information, and those that they share with all columns.
  // No rows where the model has no times.
  Eigen::VectorXd times_g;
  Eigen::MatrixXd times_H, times_by_columns;
};

PairAlone ProjectOwnOut(const PairSystem& s, const TimedPair& pair) {
  const bool with_times = s.times_column >= 0;
  const Eigen::Index first = with_times ? s.times_column : s.N.cols();
  const Eigen::Index last = s.N.cols() - first - (with_times ? 2 : 0);
  PairAlone p;
  Eigen::MatrixXd N(s.N.rows(), first + last);
  N << s.N.leftCols(first), s.N.rightCols(last);
  Eigen::VectorXd prior(first + last), at(first + last);
  prior << s.prior.head(first), s.prior.tail(last);
  at << s.at.head(first), s.at.tail(last);
  Eigen::MatrixXd A = N.transpose() * N;
  A.diagonal() += prior;
  A.diagonal().array() += 1e-9;
  const SymmetricSolver solver(A);
  const Eigen::MatrixXd NJ = N.transpose() * s.J;
  const Eigen::VectorXd Nr = N.transpose() * s.r + prior.cwiseProduct(at);
  const Eigen::MatrixXd X = solver.Solve(NJ);
  const Eigen::VectorXd x = solver.Solve(Nr);
  p.g = s.J.transpose() * s.r - NJ.transpose() * x;
  p.H = Eigen::MatrixXd::Zero(s.J.cols(), s.J.cols());
  p.H.selfadjointView<Eigen::Lower>().rankUpdate(s.J.transpose());
  p.H.triangularView<Eigen::StrictlyUpper>() = p.H.transpose();
  p.H.noalias() -= NJ.transpose() * X;
  p.chi2 = s.r.squaredNorm() + at.dot(prior.cwiseProduct(at)) - Nr.dot(x);
  if (with_times) {
    const auto T = s.N.middleCols<2>(first);
    const Eigen::MatrixXd NT = N.transpose() * T;
    p.frames = {pair.frame_a, pair.frame_b};
    p.frame_time_prior = s.prior.segment<2>(first);
    p.times_g = T.transpose() * s.r - NT.transpose() * x;
    p.times_H = T.transpose() * T - NT.transpose() * solver.Solve(NT);
    p.times_by_columns = T.transpose() * s.J - NT.transpose() * X;
    const Eigen::Vector2d to_stamps = -s.at.segment<2>(first);
    const Eigen::VectorXd change = p.times_H * to_stamps;
    p.g += p.times_by_columns.transpose() * to_stamps;
    p.chi2 += to_stamps.dot(2.0 * p.times_g + change);
    p.times_g += change;
  }
  return p;
}

// The own times of a block's frames [s after their stamps], linear in all columns. Each frame has
// one, whatever the pairs that it is in: of each pair by itself, every interval between frames
// would be as open as one frame's time is (docs/lab/random_devices.md).
class TimesOfBlock {
 public:
  TimesOfBlock(const std::vector<PairAlone>& pairs, Eigen::Index columns) {
    std::map<int, double> uses;
    for (const PairAlone& p : pairs) {
      if (p.times_g.size() == 0) continue;
      for (const int frame : p.frames) {
        rows_.emplace(frame, static_cast<Eigen::Index>(rows_.size()));
        ++uses[frame];
      }
    }
    const auto frames = static_cast<Eigen::Index>(rows_.size());
    Eigen::MatrixXd D = Eigen::MatrixXd::Zero(frames, frames);
    Eigen::MatrixXd by_columns = Eigen::MatrixXd::Zero(frames, columns);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(frames);
    for (const PairAlone& p : pairs) {
      for (Eigen::Index i = 0; i < p.times_g.size(); ++i) {
        const int frame = p.frames.at(static_cast<size_t>(i));
        const Eigen::Index row = rows_[frame];
        const double part = 1.0 / uses[frame];  // of the prior, which each frame has once
        b[row] += p.times_g[i];
        D(row, row) += part * p.frame_time_prior[i];
        log_det_ -= part * std::log(p.frame_time_prior[i]);
        by_columns.row(row) += p.times_by_columns.row(i);
        for (Eigen::Index j = 0; j < 2; ++j) {
          D(row, rows_[p.frames.at(static_cast<size_t>(j))]) += p.times_H(i, j);
        }
      }
    }
    if (frames == 0) return;
    const SymmetricSolver solver(D);
    log_det_ += solver.LogDeterminant();
    by_columns_ = -solver.Solve(by_columns);
    best_s_ = -solver.Solve(b);
  }

  bool empty() const { return rows_.empty(); }
  double log_det() const { return log_det_; }  // over that of the prior
  // With the columns as they are, and how the columns change them. Of a frame of no pair: its
  // stamp.
  double Best(int frame) const {
    const auto row = rows_.find(frame);
    return row == rows_.end() ? 0.0 : best_s_[row->second];
  }
  auto ByColumns(int frame) const { return by_columns_.row(rows_.at(frame)); }

 private:
  std::map<int, Eigen::Index> rows_;
  Eigen::MatrixXd by_columns_;
  Eigen::VectorXd best_s_;
  double log_det_ = 0.0;
};

// Sums the pairs of a block, with the frames' own times projected out of all of them together.
void SumUp(const std::vector<PairAlone>& projected, int num_model, std::vector<PairScore>* pairs,
           BlockScore* block) {
  const TimesOfBlock times(projected, block->g.size());
  block->log_det = times.log_det();
  for (size_t k = 0; k < projected.size(); ++k) {
    const PairAlone& p = projected[k];
    PairScore& pair = (*pairs)[k];
    Eigen::MatrixXd H = p.H;
    pair.g = p.g;
    pair.chi2 = p.chi2;
    pair.log_det = times.log_det() / static_cast<double>(projected.size());
    for (Eigen::Index i = 0; i < p.times_g.size(); ++i) {
      const int frame = p.frames.at(static_cast<size_t>(i));
      const auto by_columns = p.times_by_columns.row(i).transpose();
      pair.g += by_columns * times.Best(frame);
      pair.chi2 += p.times_g[i] * times.Best(frame);
      // Half of it and half of its transpose: the sum over the block is symmetric anyway.
      const Eigen::MatrixXd half = 0.5 * by_columns * times.ByColumns(frame);
      H += half + half.transpose();
    }
    block->g += pair.g;
    block->H += H;
    block->chi2 += pair.chi2;
    block->residuals += pair.residuals;
    ++block->pairs;
    pair.H = H.topLeftCorner(num_model, num_model);
  }
}

// Likelihood of two widths of the bend, all else of the pair projected out: with u the bend's score
// and W its information, 2 log L(s) = u (W + s^-2)^-1 u - log det(1 + s^2 W).
double GainOfFreeBend(const PairSystem& s) {
  if (s.bend_column < 0) return 0.0;
  const Eigen::Index at = s.bend_column;
  Eigen::VectorXd wide = s.prior;
  wide.segment<6>(at) = s.free_bend;
  const auto two_log = [&](const Eigen::VectorXd& prior) {
    Eigen::MatrixXd B = s.N.transpose() * s.N;
    B.diagonal() += prior;
    B.diagonal().array() += 1e-9;
    const SymmetricSolver solver(B);
    const Eigen::VectorXd b = s.N.transpose() * s.r + prior.cwiseProduct(s.at);
    return b.dot(solver.Solve(b).col(0)) - s.at.dot(prior.cwiseProduct(s.at)) -
           solver.LogDeterminant() + prior.segment<6>(at).array().log().sum();
  };
  return two_log(wide) - two_log(s.prior);
}

}  // namespace

Scores ComputeScores(const EstimationInput& input, const std::vector<PairBlock>& blocks,
                     const Calibration& calibration, std::shared_ptr<const EffectSet> candidates,
                     double noise, const PairGraphOptions& options) {
  const AllEffects all = AllEffectsOf(calibration, candidates.get());
  const AllEffects of_model = AllEffectsOf(calibration, nullptr);
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
    std::vector<PairAlone> projected;
    const auto linearise = [&](const AllEffects& effects, const TimesOfBlock* times) {
      projected.clear();
      pairs[b].clear();
      for (const TimedPair& pair : block) {
        PairSystem system;
        std::optional<Eigen::Vector2d> times_s;
        if (times) times_s.emplace(times->Best(pair.frame_a), times->Best(pair.frame_b));
        if (!MakePairSystem(input, pair, calibration, effects, noise, options, &system, times_s)) {
          continue;
        }
        PairScore score;
        score.frame_b = pair.frame_b;
        score.time_s = pair.time_b_s;
        // The direction takes two; the bend none, since chi2 has the penalty of its prior.
        score.residuals = static_cast<int>(system.r.size()) -
                          (ResidualOf(pair, options).facts().has_direction ? 2 : 0);
        score.latent_gain = GainOfFreeBend(system);
        projected.push_back(ProjectOwnOut(system, pair));
        pairs[b].push_back(std::move(score));
      }
    };
    // At the times that each pair's own matches tell, which differ by what each has wrong. Where
    // they tell any, these are all that is taken from it, and the candidates have no part in them.
    const bool with_times = all.frame_time_spread_s > 0.0;
    linearise(with_times ? of_model : all, nullptr);
    if (with_times) {
      const TimesOfBlock times(projected, scores.num_model);
      linearise(all, times.empty() ? nullptr : &times);
    }
    SumUp(projected, scores.num_model, &pairs[b], &sum);
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
