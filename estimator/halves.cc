#include "estimator/halves.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace camgyro {
namespace {

// How the two halves of a recording disagree, in view of their covariances: chi-square per
// parameter of the difference. 1 for a right model; what a constant model leaves out, and moves,
// shows here.
double HalvesChi2(const Calibration& first, const Calibration& second) {
  const StateVector d = Difference(first, second);
  const StateCovariance sum = first.covariance + second.covariance;
  // Unit diagonal before the factorisation: the units differ by orders of magnitude.
  const StateVector scale = sum.diagonal().cwiseSqrt().cwiseInverse();
  const StateCovariance correlation = scale.asDiagonal() * sum * scale.asDiagonal();
  const StateVector z = scale.cwiseProduct(d);
  return z.dot(correlation.ldlt().solve(z)) / kStateSize;
}

}  // namespace

Halves FitHalves(const EstimationInput& input, const Calibration& from, const Prior& prior,
                 const RefinementOptions& refinement) {
  const auto middle = input.pairs.begin() + static_cast<std::ptrdiff_t>(input.pairs.size() / 2);
  std::array<std::vector<TimedPair>, 2> halves;
  halves[0].assign(input.pairs.begin(), middle);
  for (auto pair = middle; pair != input.pairs.end(); ++pair) {
    if (pair->time_a_s > halves[0].back().time_b_s) halves[1].push_back(*pair);
  }
  RefinementOptions options = refinement;
  options.max_rounds = std::min(4, refinement.max_rounds);
  options.cluster_s = 0.5 * refinement.cluster_s;
  std::array<Calibration, 2> fits;
  UnseenFit unseen;
  bool both = true;
  for (size_t h = 0; h < 2; ++h) {
    const Result<Refined> half = Refine(input, halves[h], from, prior, options);
    if (!half) {
      both = false;
      continue;
    }
    fits[h] = half->calibration;
    if (halves[1 - h].empty() || halves[1 - h].front().matches.empty()) continue;  // attitudes
    const UnseenFit other = EvaluateUnseen(input, halves[1 - h], half->calibration,
                                           half->quality.noise_px, refinement.graph);
    unseen.rms_px = std::sqrt((unseen.matches * unseen.rms_px * unseen.rms_px +
                               other.matches * other.rms_px * other.rms_px) /
                              std::max(1, unseen.matches + other.matches));
    unseen.matches += other.matches;
    unseen.pairs += other.pairs;
  }
  Halves result;
  if (unseen.matches > 0) result.unseen = unseen;
  if (both) result.chi2 = HalvesChi2(fits[0], fits[1]);
  return result;
}

}  // namespace camgyro
