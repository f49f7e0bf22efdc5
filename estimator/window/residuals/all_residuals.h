// The residuals that a pair of frames can be held against.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_RESIDUALS_ALL_RESIDUALS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_RESIDUALS_ALL_RESIDUALS_H_

#include <string>
#include <vector>

#include "core/result.h"
#include "estimator/window/residuals/pair_residual.h"

namespace camgyro {

// One row per residual, in the order of the help: a row X is ByX() in x.cc.
#define CAMGYRO_RESIDUALS(ROW) \
  ROW(Plane)                   \
  ROW(Determinant)             \
  ROW(Transfer)                \
  ROW(Attitudes)

#define CAMGYRO_DECLARE(name) const PairResidual& By##name();
CAMGYRO_RESIDUALS(CAMGYRO_DECLARE)
#undef CAMGYRO_DECLARE

// Those of matches: a user may choose among them.
std::vector<const PairResidual*> ChoosableResiduals();
// The one of this name. Errors: kBadUsage, with the names that there are.
Result<const PairResidual*> FindResidual(const std::string& name);
// What a flag that chooses one says of them.
std::string HelpOfResiduals();

// What a pair is held against: the chosen one, or its attitudes.
const PairResidual& ResidualOf(const TimedPair& pair, const PairGraphOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_RESIDUALS_ALL_RESIDUALS_H_
