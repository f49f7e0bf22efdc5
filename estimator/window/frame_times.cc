#include "estimator/window/frame_times.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "core/format.h"

namespace camgyro {
namespace {

// The pairs' sums: W and score over all frames.
struct System {
  System(const std::vector<PairTimes>& pairs, const LateFrames& late) {
    for (const PairTimes& pair : pairs) {
      for (const int64_t frame : {pair.frame_a, pair.frame_b}) at.emplace(frame, 0);
    }
    int next = 0;
    for (auto& entry : at) entry.second = next++;
    score.setZero(next);
    is_late.resize(static_cast<size_t>(next));
    for (const auto& [frame, row] : at) is_late[static_cast<size_t>(row)] = late.count(frame) > 0;
    std::vector<Eigen::Triplet<double>> entries;
    for (const PairTimes& pair : pairs) {
      const int index[2] = {at.at(pair.frame_a), at.at(pair.frame_b)};
      for (int i = 0; i < 2; ++i) {
        score[index[i]] += pair.score[i];
        for (int k = 0; k < 2; ++k) {
          entries.emplace_back(index[i], index[k], pair.information(i, k));
        }
      }
    }
    information.resize(next, next);
    information.setFromTriplets(entries.begin(), entries.end());
  }

  // I + S W S, factorised.
  void Factorise(double spread_s) {
    spreads.resize(score.size());
    for (Eigen::Index i = 0; i < score.size(); ++i) {
      spreads[i] = is_late[static_cast<size_t>(i)] ? kMostSpreadS : spread_s;
    }
    Eigen::SparseMatrix<double> A = spreads.asDiagonal() * information * spreads.asDiagonal();
    for (Eigen::Index i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1.0;
    solver.compute(A);
  }

  std::map<int64_t, int> at;  // frame: row
  std::vector<bool> is_late;
  Eigen::VectorXd score, spreads;
  Eigen::SparseMatrix<double> information;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
};

// Where 2 log L is 1 less than that of the least spread, the most likely one, and falls.
double LeastUnlikely(const std::function<double(double)>& two_log_likelihood) {
  double low = std::log(kLeastSpreadS), high = std::log(kMostSpreadS);
  const double limit = two_log_likelihood(low) - 1.0;
  while (high - low > 1e-3) {
    const double middle = 0.5 * (low + high);
    (two_log_likelihood(middle) > limit ? low : high) = middle;
  }
  return std::exp(high);
}

// What all pairs say of a frame, without its own prior. Nothing: sigma_s is infinite.
FrameOffset WithoutPrior(const FrameOffset& frame, double prior_sigma_s) {
  const double with = std::pow(frame.sigma_s, -2), without = with - std::pow(prior_sigma_s, -2);
  if (!(without > 1e-12 * with)) {
    return {frame.frame, 0.0, std::numeric_limits<double>::infinity()};
  }
  return {frame.frame, frame.offset_s * with / without, 1.0 / std::sqrt(without)};
}

// A frame that may be late, by these odds, and then has late_spread_s. How likely it is.
double OverBothCases(const FrameOffset& on_time, double spread_s, double late_spread_s, double odds,
                     FrameOffset* frame) {
  const FrameOffset alone = WithoutPrior(on_time, spread_s);
  const auto likelihood = [&](double spread) {
    const double sigma_s = std::hypot(spread, alone.sigma_s);
    return std::exp(-0.5 * std::pow(alone.offset_s / sigma_s, 2)) / sigma_s;
  };
  if (!std::isinf(alone.sigma_s)) odds *= likelihood(late_spread_s) / likelihood(spread_s);
  const double share = odds / (1.0 + odds);
  const double information = std::pow(alone.sigma_s, -2);
  const double variance_late = 1.0 / (information + std::pow(late_spread_s, -2));
  const double late_s = alone.offset_s * information * variance_late;
  const double mean_s = (1.0 - share) * on_time.offset_s + share * late_s;
  const double variance =
      (1.0 - share) * (std::pow(on_time.sigma_s, 2) + std::pow(on_time.offset_s - mean_s, 2)) +
      share * (variance_late + std::pow(late_s - mean_s, 2));
  *frame = {on_time.frame, mean_s, std::sqrt(variance)};
  return share;
}

double TwoLogLikelihood(System* system, double spread_s) {
  system->Factorise(spread_s);
  const Eigen::VectorXd scaled = system->spreads.cwiseProduct(system->score);
  return scaled.dot(system->solver.solve(scaled)) -
         system->solver.vectorD().array().max(1e-300).log().sum();
}

}  // namespace

double TwoLogLikelihood(const std::vector<PairTimes>& pairs, double spread_s) {
  System system(pairs, {});
  return TwoLogLikelihood(&system, spread_s);
}

Spread MostLikelySpread(const std::vector<PairTimes>& pairs, const LateFrames& late) {
  if (pairs.empty()) return {kLeastSpreadS, kMostSpreadS};
  System system(pairs, late);
  const auto value = [&](double log_s) { return TwoLogLikelihood(&system, std::exp(log_s)); };
  const double low = std::log(kLeastSpreadS), high = std::log(kMostSpreadS);
  // A grid for the right hill, then golden sections.
  constexpr int kGrid = 24;
  const double step = (high - low) / kGrid;
  int best = 0;
  double most = value(low);
  for (int i = 1; i <= kGrid; ++i) {
    const double here = value(low + i * step);
    if (here > most) {
      most = here;
      best = i;
    }
  }
  if (best == 0) return {kLeastSpreadS, LeastUnlikely(value)};
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double a = low + (best - 1) * step, b = std::min(high, low + (best + 1) * step);
  double c = b - golden * (b - a), d = a + golden * (b - a);
  double at_c = value(c), at_d = value(d);
  while (b - a > 1e-4) {
    if (at_c > at_d) {
      b = d;
      d = c;
      at_d = at_c;
      c = b - golden * (b - a);
      at_c = value(c);
    } else {
      a = c;
      c = d;
      at_c = at_d;
      d = a + golden * (b - a);
      at_d = value(d);
    }
  }
  const double log_s = 0.5 * (a + b), h = 0.05;
  const double curvature =
      -0.5 * (value(log_s + h) - 2.0 * value(log_s) + value(log_s - h)) / (h * h);
  const double spread = std::exp(log_s);
  return {spread, curvature > 0.0 ? spread / std::sqrt(curvature) : spread};
}

FrameTimeLaw MostLikelyLaw(const std::vector<PairTimes>& pairs) {
  const Spread of_all = MostLikelySpread(pairs);
  FrameTimeLaw law{of_all, {}};
  LateFrames cleared;
  for (;;) {
    if (!law.late.empty()) law.spread = MostLikelySpread(pairs, law.late);
    bool found = false;
    // The late frame that is the least so, if it is not by what the others tell: a frame that is
    // drawn along by a late one that it makes a pair with looks late before that one does.
    double least = kLateSpreads;
    int64_t innocent = 0;
    for (const FrameOffset& frame : OffsetsOf(pairs, law.spread.value_s, law.late)) {
      const bool is_late = law.late.count(frame.frame) > 0;
      const FrameOffset alone = WithoutPrior(frame, is_late ? kMostSpreadS : law.spread.value_s);
      const double spreads =
          std::abs(alone.offset_s) / std::hypot(law.spread.value_s, alone.sigma_s);
      if (is_late && spreads < least) {
        least = spreads;
        innocent = frame.frame;
      } else if (!is_late && spreads > kLateSpreads && cleared.count(frame.frame) == 0) {
        law.late.insert(frame.frame);
        found = true;
      }
    }
    if (found) continue;
    if (least == kLateSpreads) break;
    law.late.erase(innocent);
    cleared.insert(innocent);
  }
  return law.spread.value_s < kSpreadOfOthers * of_all.value_s ? law : FrameTimeLaw{of_all, {}};
}

std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, double spread_s,
                                   const LateFrames& late) {
  System system(pairs, late);
  system.Factorise(spread_s);
  const Eigen::VectorXd mean =
      -system.spreads.cwiseProduct(system.solver.solve(system.spreads.cwiseProduct(system.score)));
  std::vector<FrameOffset> offsets;
  Eigen::VectorXd unit = Eigen::VectorXd::Zero(mean.size());
  for (const auto& [frame, row] : system.at) {
    unit[row] = 1.0;
    const double variance = system.solver.solve(unit)[row];
    unit[row] = 0.0;
    offsets.push_back({frame, mean[row], system.spreads[row] * std::sqrt(variance)});
  }
  return offsets;
}

std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, const FrameTimeLaw& law) {
  constexpr int kRounds = 20;  // of the odds, which change by less and less
  const double spread_s = std::min(kMostSpreadS, std::max(law.spread.value_s, law.spread.sigma_s));
  const std::vector<FrameOffset> by_law = OffsetsOf(pairs, spread_s, law.late);
  if (law.late.empty()) return by_law;
  double sum_sq = 0.0;
  for (const FrameOffset& frame : by_law) {
    if (law.late.count(frame.frame) > 0) sum_sq += std::pow(frame.offset_s, 2);
  }
  const auto found = static_cast<double>(law.late.size());
  const double late_spread_s = std::sqrt(sum_sq / found);
  std::vector<FrameOffset> offsets = by_law;
  double late = found;
  for (int round = 0; round < kRounds; ++round) {
    const double odds = late / std::max(1.0, static_cast<double>(offsets.size()) - late);
    late = found;
    for (size_t i = 0; i < offsets.size(); ++i) {
      if (law.late.count(by_law[i].frame) == 0) {
        late += OverBothCases(by_law[i], spread_s, late_spread_s, odds, &offsets[i]);
      }
    }
  }
  return offsets;
}

std::string Describe(const LateFrames& late, const std::vector<FrameOffset>& offsets) {
  double most_s = 0.0;
  for (const FrameOffset& frame : offsets) {
    if (late.count(frame.frame) > 0) most_s = std::max(most_s, std::abs(frame.offset_s));
  }
  return Format(
      "%zu of %zu frames are later, or earlier, than the spread of the others allows, by up to "
      "%.2g ms: they have the times that their matches tell, and the delay is that of the others",
      late.size(), offsets.size(), 1e3 * most_s);
}

}  // namespace camgyro
