#include "estimator/halves.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/astray.h"

namespace camgyro {
namespace {

// A half is some 2.3 sigmas from the whole, by its noise alone (11 parameters, of which the whole
// knows half): the directions are still the right ones, and are searched anew only where the half
// leaves the whole by more.
constexpr double kSettledRound = 5.0;
// A chi-square per parameter that is to be near 1 or not needs no better sigmas than these.
constexpr double kSettledScale = 0.1;

// Chi-square per parameter of a difference of states.
double Chi2PerParameter(const StateVector& d, const StateCovariance& covariance) {
  // Unit diagonal before the factorisation: the units differ by orders of magnitude.
  const StateVector scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const StateCovariance correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const StateVector z = scale.cwiseProduct(d);
  return z.dot(correlation.ldlt().solve(z)) / kStateSize;
}

}  // namespace

double HalvesChi2(const Calibration& first, const Calibration& second, const Calibration& whole) {
  // A half that has run away cannot tell its lens alone, and says nothing of the whole.
  const bool first_away = RanAway(first.lens[kFocal], whole.lens[kFocal]);
  if (first_away == RanAway(second.lens[kFocal], whole.lens[kFocal])) {
    return Chi2PerParameter(Difference(first, second), first.covariance + second.covariance);
  }
  const Calibration& half = first_away ? second : first;
  return Chi2PerParameter(Difference(half, whole), 0.5 * half.covariance);
}

HalvesFit::HalvesFit(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                     const Refined& whole, const Prior& prior, const RefinementOptions& refinement)
    : input_(input), whole_(whole), prior_(prior), refinement_(refinement) {
  const auto middle = pairs.begin() + static_cast<std::ptrdiff_t>(pairs.size() / 2);
  halves_[0].assign(pairs.begin(), middle);
  for (auto pair = middle; pair != pairs.end(); ++pair) {
    if (pair->time_a_s > halves_[0].back().time_b_s) halves_[1].push_back(*pair);
  }
}

void HalvesFit::Fit(size_t half) {
  RefinementOptions options = refinement_;
  options.max_rounds = std::min(4, refinement_.max_rounds);
  options.settled_round = kSettledRound;
  options.settled_scale = kSettledScale;
  options.cluster_s = 0.5 * refinement_.cluster_s;
  options.graph.sigma = whole_.quality.noise_px;
  options.latents = whole_.latents;
  // A half that runs away would find much noise where the whole fits, and run on.
  options.find_noise_factors = false;
  const Result<Refined> fit = Refine(input_, halves_.at(half), whole_.calibration, prior_, options);
  if (!fit) return;
  fits_.at(half) = fit->calibration;
  const std::vector<TimedPair>& other = halves_.at(1 - half);
  if (other.empty() || other.front().matches.empty()) return;  // attitudes
  others_.at(half) =
      EvaluateUnseen(input_, other, fit->calibration, fit->quality.noise_px, refinement_.graph);
}

Halves HalvesFit::Compare() const {
  UnseenFit unseen;
  for (const auto& other : others_) {
    if (!other) continue;
    unseen.rms_px = std::sqrt((unseen.matches * unseen.rms_px * unseen.rms_px +
                               other->matches * other->rms_px * other->rms_px) /
                              std::max(1, unseen.matches + other->matches));
    unseen.matches += other->matches;
    unseen.pairs += other->pairs;
  }
  Halves result;
  if (unseen.matches > 0) result.unseen = unseen;
  if (!fits_[0] || !fits_[1]) return result;
  result.chi2 = HalvesChi2(*fits_[0], *fits_[1], whole_.calibration);
  return result;
}

}  // namespace camgyro
