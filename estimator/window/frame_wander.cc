#include "estimator/window/frame_wander.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "core/format.h"

namespace camgyro {
namespace {

// Two parameters more than white offsets have: chi-square at a hundredth.
constexpr double kSignificant = 9.21;
constexpr double kShortestTimeS = 0.1;  // a few frames
// What is slower than a quarter of the recording is no wander that it could show.
constexpr double kLongestOfRecording = 0.25;
constexpr double kLeastOfWhite = 1e-3;  // where a part of the offsets counts as none

// The unknowns are the white part and the slow one of every frame's offset, each in its standard
// deviation: o = white u + slow g. Their information is
//   A = [ I + white^2 W    white slow W   ]
//       [ white slow W     T + slow^2 W   ]
// with T of a Gauss-Markov process with variance 1, which couples neighbours only.
class WanderSystem {
 public:
  explicit WanderSystem(const std::vector<PairTimes>& pairs, const LateFrames& late = {}) {
    std::map<int64_t, Eigen::Index> at;
    for (const PairTimes& pair : pairs) {
      for (const int64_t frame : {pair.frame_a, pair.frame_b}) at.emplace(frame, 0);
    }
    for (auto& entry : at) {
      entry.second = static_cast<Eigen::Index>(times_s_.size());
      numbers_.push_back(entry.first);
      times_s_.push_back(1e-9 * static_cast<double>(entry.first));
      is_late_.push_back(late.count(entry.first) > 0);
    }
    score_.setZero(frames());
    for (const PairTimes& pair : pairs) {
      const std::array<Eigen::Index, 2> index{at.at(pair.frame_a), at.at(pair.frame_b)};
      for (int i = 0; i < 2; ++i) {
        score_[index.at(i)] += pair.score[i];
        for (int k = 0; k < 2; ++k) {
          information_.emplace_back(index.at(i), index.at(k), pair.information(i, k));
        }
      }
    }
  }

  Eigen::Index frames() const { return static_cast<Eigen::Index>(times_s_.size()); }
  double duration_s() const { return times_s_.empty() ? 0.0 : times_s_.back() - times_s_.front(); }

  double TwoLogLikelihood(const FrameWander& wander) {
    Factorise(wander);
    const Eigen::VectorXd b = Both(wander, score_);
    return b.dot(solver_.solve(b)) - solver_.vectorD().array().max(1e-300).log().sum() +
           log_det_prior_;
  }

  // What the pairs say of a shift of all frames, less what the offsets take of it.
  double InformationOfShift(const FrameWander& wander) {
    Factorise(wander);
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(frames());
    for (const auto& entry : information_) sums[entry.row()] += entry.value();
    const Eigen::VectorXd b = Both(wander, sums);
    return sums.sum() - b.dot(solver_.solve(b));
  }

  std::vector<FrameOffset> Offsets(const FrameWander& wander) {
    Factorise(wander);
    const Eigen::Index n = frames();
    const Eigen::VectorXd parts = -solver_.solve(Both(wander, score_));
    std::vector<FrameOffset> offsets;
    Eigen::VectorXd of_frame = Eigen::VectorXd::Zero(2 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      of_frame[i] = WhiteOf(wander, i);
      of_frame[n + i] = wander.slow_s;
      offsets.push_back({numbers_[static_cast<size_t>(i)], of_frame.dot(parts),
                         std::sqrt(of_frame.dot(solver_.solve(of_frame)))});
      of_frame[i] = of_frame[n + i] = 0.0;
    }
    return offsets;
  }

 private:
  // Standard deviation of a frame's white part; a late one's is anything.
  double WhiteOf(const FrameWander& wander, Eigen::Index i) const {
    return is_late_[static_cast<size_t>(i)] ? kMostSpreadS : wander.white_s;
  }

  Eigen::VectorXd Both(const FrameWander& wander, const Eigen::VectorXd& v) const {
    Eigen::VectorXd both(2 * v.size());
    both << v, wander.slow_s * v;
    for (Eigen::Index i = 0; i < v.size(); ++i) both[i] *= WhiteOf(wander, i);
    return both;
  }

  void Factorise(const FrameWander& wander) {
    const Eigen::Index n = frames();
    const double s = wander.slow_s;
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(4 * information_.size() + static_cast<size_t>(5 * n));
    for (const auto& entry : information_) {
      const Eigen::Index i = entry.row(), k = entry.col();
      const double white_i = WhiteOf(wander, i), white_k = WhiteOf(wander, k);
      entries.emplace_back(i, k, white_i * white_k * entry.value());
      entries.emplace_back(i, n + k, white_i * s * entry.value());
      entries.emplace_back(n + i, k, s * white_k * entry.value());
      entries.emplace_back(n + i, n + k, s * s * entry.value());
    }
    for (Eigen::Index i = 0; i < n; ++i) entries.emplace_back(i, i, 1.0);
    if (n > 0) entries.emplace_back(n, n, 1.0);
    log_det_prior_ = 0.0;
    for (Eigen::Index i = 1; i < n; ++i) {  // (g_i - a g_i-1) / sqrt(1 - a^2)
      const double gap_s = times_s_[static_cast<size_t>(i)] - times_s_[static_cast<size_t>(i - 1)];
      const double a = wander.time_s > 0.0 ? std::exp(-gap_s / wander.time_s) : 0.0;
      const double variance = wander.time_s > 0.0 ? -std::expm1(-2.0 * gap_s / wander.time_s) : 1.0;
      entries.emplace_back(n + i, n + i, 1.0 / variance);
      entries.emplace_back(n + i - 1, n + i - 1, a * a / variance);
      entries.emplace_back(n + i, n + i - 1, -a / variance);
      entries.emplace_back(n + i - 1, n + i, -a / variance);
      log_det_prior_ -= std::log(variance);
    }
    Eigen::SparseMatrix<double> A(2 * n, 2 * n);
    A.setFromTriplets(entries.begin(), entries.end());
    if (!analysed_) solver_.analyzePattern(A);
    analysed_ = true;
    solver_.factorize(A);
  }

  std::vector<int64_t> numbers_;  // of frames
  std::vector<double> times_s_;
  std::vector<bool> is_late_;
  Eigen::VectorXd score_;
  std::vector<Eigen::Triplet<double>> information_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  bool analysed_ = false;
  double log_det_prior_ = 0.0;
};

// Climbs in the logarithms of both standard deviations, in steps that halve where none is better.
FrameWander Climb(FrameWander from, WanderSystem* system) {
  from.two_log_likelihood = system->TwoLogLikelihood(from);
  for (double step = 0.5; step > 0.05;) {
    FrameWander best = from;
    for (const auto& [white, slow] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
      FrameWander next = from;
      next.white_s *= std::exp(step * white);
      next.slow_s *= std::exp(step * slow);
      next.two_log_likelihood = system->TwoLogLikelihood(next);
      if (next.two_log_likelihood > best.two_log_likelihood) best = next;
    }
    if (best.two_log_likelihood > from.two_log_likelihood &&
        best.white_s > kLeastOfWhite * best.slow_s && best.slow_s > kLeastOfWhite * best.white_s) {
      from = best;
    } else {
      step *= 0.5;
    }
  }
  return from;
}

}  // namespace

double TwoLogLikelihood(const std::vector<PairTimes>& pairs, const FrameWander& wander) {
  return WanderSystem(pairs).TwoLogLikelihood(wander);
}

FrameWander MostLikelyWander(const std::vector<PairTimes>& pairs, double white_s,
                             const LateFrames& late) {
  FrameWander white;
  white.white_s = white_s;
  if (pairs.empty() || !(white_s > kLeastSpreadS)) return white;
  WanderSystem system(pairs, late);
  const double none = system.TwoLogLikelihood(white);
  FrameWander best = white;
  const double part_s = white_s / std::sqrt(2.0);
  FrameWander from{part_s, part_s, kShortestTimeS, 0.0};
  for (; from.time_s < kLongestOfRecording * system.duration_s(); from.time_s *= 2.0) {
    FrameWander found = Climb(from, &system);
    found.two_log_likelihood -= none;
    from.white_s = found.white_s;
    from.slow_s = found.slow_s;
    if (found.two_log_likelihood > best.two_log_likelihood) best = found;
  }
  return best.two_log_likelihood > kSignificant ? best : white;
}

std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, const FrameWander& wander,
                                   const LateFrames& late) {
  return WanderSystem(pairs, late).Offsets(wander);
}

double VarianceOfShift(const std::vector<PairTimes>& pairs, const FrameWander& wander,
                       const LateFrames& late) {
  return 1.0 / WanderSystem(pairs, late).InformationOfShift(wander);
}

std::string Describe(const FrameWander& wander) {
  return Format(
      "the frames' own times wander together, by %.2g ms within some %.2g s, beside %.2g ms from "
      "frame to frame: the delay is that of their mean, and its sigma says how well this one "
      "recording knows it",
      1e3 * wander.slow_s, wander.time_s, 1e3 * wander.white_s);
}

}  // namespace camgyro
