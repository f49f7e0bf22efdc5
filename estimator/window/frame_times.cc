#include "estimator/window/frame_times.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace camgyro {
namespace {

// The pairs' sums: W and score over all frames.
struct System {
  explicit System(const std::vector<PairTimes>& pairs) {
    for (const PairTimes& pair : pairs) {
      for (const int64_t frame : {pair.frame_a, pair.frame_b}) at.emplace(frame, 0);
    }
    int next = 0;
    for (auto& entry : at) entry.second = next++;
    score.setZero(next);
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

  // I + s^2 W, factorised.
  void Factorise(double spread_s) {
    Eigen::SparseMatrix<double> A = spread_s * spread_s * information;
    for (Eigen::Index i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1.0;
    solver.compute(A);
  }

  std::map<int64_t, int> at;  // frame: row
  Eigen::VectorXd score;
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

double TwoLogLikelihood(System* system, double spread_s) {
  system->Factorise(spread_s);
  const Eigen::VectorXd solved = system->solver.solve(system->score);
  return spread_s * spread_s * system->score.dot(solved) -
         system->solver.vectorD().array().max(1e-300).log().sum();
}

}  // namespace

double TwoLogLikelihood(const std::vector<PairTimes>& pairs, double spread_s) {
  System system(pairs);
  return TwoLogLikelihood(&system, spread_s);
}

Spread MostLikelySpread(const std::vector<PairTimes>& pairs) {
  if (pairs.empty()) return {kLeastSpreadS, kMostSpreadS};
  System system(pairs);
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

std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, double spread_s) {
  System system(pairs);
  system.Factorise(spread_s);
  const Eigen::VectorXd mean = -spread_s * spread_s * system.solver.solve(system.score);
  std::vector<FrameOffset> offsets;
  Eigen::VectorXd unit = Eigen::VectorXd::Zero(mean.size());
  for (const auto& [frame, row] : system.at) {
    unit[row] = 1.0;
    const double variance = system.solver.solve(unit)[row];
    unit[row] = 0.0;
    offsets.push_back({frame, mean[row], spread_s * std::sqrt(variance)});
  }
  return offsets;
}

std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, const Spread& spread) {
  return OffsetsOf(pairs, std::min(kMostSpreadS, std::hypot(spread.value_s, spread.sigma_s)));
}

}  // namespace camgyro
