// A landmark whose tracker drifts: what a later sighting adds to an earlier one.
#ifndef CAMGYRO_FACTORS_DRIFT_STEP_H_
#define CAMGYRO_FACTORS_DRIFT_STEP_H_

#include <ceres/cost_function.h>

#include <memory>

namespace camgyro {

// A tracker that re-anchors its patch at every frame adds up its errors: the point that it shows
// walks over the scene, by an independent step from each frame to the next one. Of two sightings a
// and b of it, so many frames apart,
//   r = ( e_b - e_a ) / ( sigma_px sqrt(frames) ),    e: RowProjection's residual in pixels
// is independent of what came before, whatever the walk had come to at a.
//
// Parameters  q_w_gyro 4, p_w 3, v_w 3 of the node of a; the same of the node of b; then those that
//             a and b share: gravity_w 3, p_gyro_cam 3, calibration 11, point 4
// Residual    2, in sigmas of the walk
// Neglected   that the walk is one over the scene and not over the picture: an offset that a has
//             turns and grows with the picture until b
//
// a, b: RowProjections in sigmas of sigma_a_px and sigma_b_px, which outlive the factor; sigma_px
// is that of one step.
struct DriftStepSighting {
  const ceres::CostFunction* projection = nullptr;
  double sigma_px = 1.0;
};
std::unique_ptr<ceres::CostFunction> MakeDriftStep(const DriftStepSighting& a,
                                                   const DriftStepSighting& b, double sigma_px,
                                                   double frames);

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_DRIFT_STEP_H_
