// The two halves of a recording, each fitted alone: do they agree, and does each foretell the
// other?
#ifndef CAMGYRO_ESTIMATOR_HALVES_H_
#define CAMGYRO_ESTIMATOR_HALVES_H_

#include <optional>

#include "core/calibration.h"
#include "estimator/window/refinement.h"

namespace camgyro {

// The disagreement that right models exceed once in a thousand recordings: the 99.9 % quantile of
// chi-square with 11 degrees of freedom is 31.3.
constexpr double kHalvesLimit = 31.3 / kStateSize;

struct Halves {
  double chi2 = 0.0;  // HalvesChi2, 0 if a half cannot be fitted
  std::optional<UnseenFit> unseen;
};

// Each half of the pairs is fitted alone, and the other one tells how well. The pairs across the
// middle belong to neither, so that no frame is in both.
Halves FitHalves(const EstimationInput& input, const Calibration& from, const Prior& prior,
                 const RefinementOptions& refinement);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_HALVES_H_
