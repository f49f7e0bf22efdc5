// Effects that depend on the calibration which they are part of.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_SETTLE_EFFECTS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_SETTLE_EFFECTS_H_

#include <functional>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/window/refinement.h"

namespace camgyro {

// Makes those effects anew that depend on the calibration, in the shape that it says.
void RemakeEffects(const Recording& recording, Calibration* calibration);

// Are there effects in it that depend on it?
bool HasToSettle(const Calibration& calibration);

// A fit with those effects made anew, and refitted, until it stays within a tenth of a sigma: what
// is left to gain by that would be taken for another effect's.
// `refit`: from where a fit ended, but for its effects; where it fails, the last fit stands.
using Refit = std::function<Result<Refined>(const Refined& from)>;
Refined SettleEffects(const Recording& recording, Refined fit, const Refit& refit);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_SETTLE_EFFECTS_H_
