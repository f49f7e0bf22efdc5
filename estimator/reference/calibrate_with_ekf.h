// A whole recording through the reference filter.
#ifndef CAMGYRO_ESTIMATOR_REFERENCE_CALIBRATE_WITH_EKF_H_
#define CAMGYRO_ESTIMATOR_REFERENCE_CALIBRATE_WITH_EKF_H_

#include <vector>

#include "estimator/calibrate.h"
#include "estimator/reference/implicit_ekf.h"
#include "estimator/window/estimation_input.h"

namespace camgyro {

struct EkfRun {
  std::vector<WindowUpdate> trace;  // one per updated pair of frames
  int skipped_pairs = 0;            // gyro missing, too few matches, singular
};

// Feeds pairs and readings in the order of real time. origin of both: input.origin_ns.
EkfRun RunEkf(const EstimationInput& input, const std::vector<Frame>& frames, const Prior& start,
              const EkfOptions& options);

// `calibrate --estimator=ekf`: section V.C's start (PaperStart), with what the files declare of f,
// c, t_r, t_d and q_c in place of its values; what they do not declare of f comes from the focal
// scan, of q_c from the nearest permutation of the axes. No refinement. The recording needs image
// motion. Errors: as CalibrateRecording; kCannotEstimate also if no pair could be used.
Result<CalibrationReport> CalibrateWithEkf(const Recording& recording,
                                           const CameraRotationsAt& rotations_at,
                                           const CalibrateOptions& options,
                                           const EkfOptions& ekf_options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_REFERENCE_CALIBRATE_WITH_EKF_H_
