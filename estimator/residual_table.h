// What a calibration leaves unexplained, match by match: the raw material of residual maps.
#ifndef CAMGYRO_ESTIMATOR_RESIDUAL_TABLE_H_
#define CAMGYRO_ESTIMATOR_RESIDUAL_TABLE_H_

#include <Eigen/Core>
#include <vector>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// One match under a calibration.
struct MatchResidual : MatchMisfit {
  int frame_a = 0, frame_b = 0;  // indices into Recording::frames
  Match match;
  // At which px_b was exposed, gyro clock from EstimationInput::origin_ns; effects of the clock are
  // left out.
  double time_s = 0.0;
  double rate_rad_s = 0.0;  // of the camera at that time, bias removed
};

// Residuals of all matches of the pairs that the gyro covers. Rates are the gyro's own, less the
// calibration's bias and effects; the translation direction of each pair is the best for this
// calibration; options.residual says of what (determinants: as planes). noise_px: of one
// coordinate, for the robust loss. Cost: one direction search for each pair.
std::vector<MatchResidual> ComputeResiduals(const EstimationInput& input,
                                            const std::vector<TimedPair>& pairs,
                                            const Calibration& calibration, double noise_px,
                                            const PairGraphOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_RESIDUAL_TABLE_H_
