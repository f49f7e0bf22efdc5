// What a calibration leaves unexplained, match by match: the raw material of residual maps.
#ifndef CAMGYRO_ESTIMATOR_RESIDUAL_TABLE_H_
#define CAMGYRO_ESTIMATOR_RESIDUAL_TABLE_H_

#include <Eigen/Core>
#include <vector>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph.h"

namespace camgyro {

// One match under a calibration.
struct MatchResidual {
  int frame_a = 0, frame_b = 0;  // indices into Recording::frames
  Match match;
  // At which px_b was exposed, gyro clock from EstimationInput::origin_ns; effects of the clock are
  // left out.
  double time_s = 0.0;
  double rate_rad_s = 0.0;  // of the camera at that time, bias removed
  // Signed distance from the plane of the pair (Sampson), of one noisy coordinate [px]. The sign
  // follows the sign of the pair's direction and has no meaning across pairs. Of a transfer: the
  // length of its error, times what gives it the median of one coordinate's magnitude.
  double residual_px = 0.0;
  // The shortest shift of px_b that takes the match onto the plane, if all of the error is there;
  // it lies across the epipolar line. Signed, and comparable across pairs [px]. Of a transfer: the
  // shift of px_b to where the rotation puts px_a.
  Eigen::Vector2d correction_px = Eigen::Vector2d::Zero();
  bool inlier = false;  // within PairGraphOptions::inlier_sigmas
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
