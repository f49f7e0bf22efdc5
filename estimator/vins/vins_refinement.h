// Everything of a VINS window in one problem: the second half of step (d).
#ifndef CAMGYRO_ESTIMATOR_VINS_VINS_REFINEMENT_H_
#define CAMGYRO_ESTIMATOR_VINS_VINS_REFINEMENT_H_

#include "core/result.h"
#include "estimator/vins/alignment.h"
#include "estimator/vins/initialise.h"
#include "estimator/vins/structure.h"
#include "estimator/vins/vins_window.h"

namespace camgyro {

// Minimises reprojection (factors/row_projection.h), pre-integration (factors/preintegration.h) and
// the priors of calibration, accelerometer bias and p_gyro_cam over states, gravity's direction,
// biases, landmarks and calibration. Three solves: pixel noise and accelerometer noise are
// estimated from the residuals, and observations beyond 4 sigma leave, between them. Fills
// everything of `start` but verdict and explanation. Error: kCannotEstimate if a solve fails or the
// states are not determined.
Status RefineVins(const VinsWindow& window, const VinsStructure& structure,
                  const VinsAlignment& alignment, const VinsOptions& options, VinsStart* start);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_VINS_VINS_REFINEMENT_H_
