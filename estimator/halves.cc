#include "estimator/halves.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/linear_algebra.h"
#include "core/parallel.h"
#include "estimator/astray.h"

namespace camgyro {
namespace {

// A half is some 2.3 sigmas from the whole, by its noise alone (11 parameters, of which the whole
// knows half): the directions are still the right ones, and are searched anew only where the half
// leaves the whole by more.
constexpr double kSettledRound = 5.0;
constexpr size_t kLeastPairs = 60;

// A chi-square per parameter that is to be near 1 or not needs no better sigmas than these.
constexpr double kSettledScale = 0.1;

// Chi-square per parameter of a difference of states.
double Chi2PerParameter(const StateVector& d, const StateCovariance& covariance) {
  return SquaredMahalanobis(d, covariance) / kStateSize;
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

Halves FitHalves(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                 const Refined& whole, const Prior& prior, const RefinementOptions& refinement) {
  Halves result;
  if (pairs.size() < kLeastPairs) return result;
  std::array<std::vector<TimedPair>, 2> halves;
  const auto middle = pairs.begin() + static_cast<std::ptrdiff_t>(pairs.size() / 2);
  halves[0].assign(pairs.begin(), middle);
  for (auto pair = middle; pair != pairs.end(); ++pair) {
    if (pair->time_a_s > halves[0].back().time_b_s) halves[1].push_back(*pair);
  }
  RefinementOptions options = refinement;
  options.max_rounds = std::min(4, refinement.max_rounds);
  options.settled_round = kSettledRound;
  options.settled_scale = kSettledScale;
  options.cluster_s = 0.5 * refinement.cluster_s;
  options.graph.sigma = whole.quality.noise_px;
  options.latents = whole.latents;
  // A half that runs away would find much noise where the whole fits, and run on.
  options.find_noise_factors = false;
  std::array<std::optional<Calibration>, 2> fits;
  std::array<std::optional<UnseenFit>, 2> others;  // of each fit, in the other half
  ParallelFor(2, [&](size_t half) {
    const Result<Refined> fit = Refine(input, halves.at(half), whole.calibration, prior, options);
    if (!fit) return;
    fits.at(half) = fit->calibration;
    const std::vector<TimedPair>& other = halves.at(1 - half);
    if (other.empty() || other.front().matches.empty()) return;  // attitudes
    others.at(half) =
        EvaluateUnseen(input, other, fit->calibration, fit->quality.noise_px, refinement.graph);
  });
  UnseenFit unseen;
  for (const auto& other : others) {
    if (!other) continue;
    const auto together = [&](double UnseenFit::*rms_px) {
      unseen.*rms_px = std::sqrt((unseen.matches * std::pow(unseen.*rms_px, 2) +
                                  other->matches * std::pow((*other).*rms_px, 2)) /
                                 std::max(1, unseen.matches + other->matches));
    };
    together(&UnseenFit::rms_px);
    together(&UnseenFit::usual_rms_px);
    together(&UnseenFit::gyro_px);
    unseen.matches += other->matches;
    unseen.pairs += other->pairs;
  }
  if (unseen.matches > 0) result.unseen = unseen;
  if (fits[0] && fits[1]) result.chi2 = HalvesChi2(*fits[0], *fits[1], whole.calibration);
  return result;
}

}  // namespace camgyro
