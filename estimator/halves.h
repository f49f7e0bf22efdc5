// The two halves of a recording, each fitted alone: do they agree, and does each foretell the
// other?
#ifndef CAMGYRO_ESTIMATOR_HALVES_H_
#define CAMGYRO_ESTIMATOR_HALVES_H_

#include <optional>
#include <vector>

#include "core/calibration.h"
#include "estimator/window/refinement.h"

namespace camgyro {

// The disagreement that right models exceed once in a thousand recordings: the 99.9 % quantile of
// chi-square with 11 degrees of freedom is 31.3.
constexpr double kHalvesLimit = 31.3 / kStateSize;

// How the doubt begins that says so.
constexpr char kHalvesDoubt[] = "the two halves of the recording disagree beyond their noise";

// How two halves disagree, in view of their covariances: chi-square per parameter of their
// difference. 1 for a right model; what a constant model leaves out, and moves, shows here. Where
// one of them alone has run away with its lens, it says nothing of the whole: then of the other one
// and the whole, which knows what that half knows, and as much again, so that their difference has
// half of the half's covariance (that of the half less that of the whole, Hausman 1978). Two that
// have run away are compared with each other.
double HalvesChi2(const Calibration& first, const Calibration& second, const Calibration& whole);

struct Halves {
  double chi2 = 0.0;  // HalvesChi2; 0 if a half cannot be fitted
  std::optional<UnseenFit> unseen;
};

// Each half of the pairs is fitted alone, beside the other, from a fit of them all, and the other
// one tells how well. The pairs across the middle belong to neither, so that no frame is in both.
// Nothing of fewer than 60 pairs: setting frames aside would cost more than it tells.
Halves FitHalves(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                 const Refined& whole, const Prior& prior, const RefinementOptions& refinement);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_HALVES_H_
