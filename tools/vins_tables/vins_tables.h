// Before and after: what a calibration is worth to a VIO that starts, and to Feng et al.'s search.
#ifndef CAMGYRO_TOOLS_VINS_TABLES_VINS_TABLES_H_
#define CAMGYRO_TOOLS_VINS_TABLES_VINS_TABLES_H_

#include <memory>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/vins/initialise.h"
#include "tools/vins_tables/motion_truth.h"

namespace camgyro {

struct RecordingWithTruth {
  std::string name;
  Recording recording;
  Calibration truth;
  std::unique_ptr<MotionTruth> motion;
  VinsOptions options;
};

// Simulated: an accelerometer bias of (0.12, -0.09, 0.06) m/s^2 is added.
Result<RecordingWithTruth> SimulateWithTruth(const std::string& name,
                                             const std::vector<std::string>& overrides);
// A recording with truth.yaml: the lens comes from there, as a camera calibration would give it;
// the motion's truth is FittedTruth.
Result<RecordingWithTruth> ReadWithTruth(const std::string& path);

// Camera rotations between neighbouring frames, as eq. (1)-(3) of Feng et al. need them.
std::vector<CameraRotation> NeighbourRotations(const Recording& recording,
                                               const Calibration& calibration);

// Windows of 2 s every step_s: prints one row per way of synchronising (none, Feng's, ours).
void TabulateInitialisation(const RecordingWithTruth& recording, const Calibration& calibrated,
                            double step_s);

// Feng's search on consecutive windows of 50 pairs: prints one row per choice of reference, and
// appends all curves to `curves_csv` if it is not empty.
Status TabulateDelaySearch(const std::string& name, const Recording& recording,
                           const Calibration& calibrated, const std::string& curves_csv);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_VINS_TABLES_VINS_TABLES_H_
