// When did the delay step?
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_TIME_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_TIME_H_

#include <optional>
#include <vector>

#include "core/calibration.h"
#include "estimator/diagnosis/shares.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph.h"

namespace camgyro {

// Puts every effect that is a step (EffectEntry::step_at) of a calibration before the frame, of
// those within `reach_s` of where it is, for which the pairs have the least chi2 with all else
// held; in the middle of the frames that are equally good (none of the pairs has them). False if
// nothing has moved. noise: of a pixel [px], of a rotation [rad] for attitudes.
bool PlaceDelaySteps(const Recording& recording, const EstimationInput& input,
                     const std::vector<TimedPair>& pairs, double reach_s, double noise,
                     const PairGraphOptions& options, Calibration* calibration);

// A step that leaves whole blocks beyond the robust loss, where scores are blind: all delays within
// 0.1 s are tried before and after every border between two blocks, with all else held.
struct LargeStep {
  double time_s = 0.0;   // camera clock, between two blocks
  double delay_s = 0.0;  // what the calibration's delay becomes, before the step
  double step_s = 0.0;
  double explained = 0.0;  // of the misfit beyond that of the blocks that fit well, in 0..1
};
// The best one; nothing if no step lowers chi2. blocks: in time order. noise: as above.
std::optional<LargeStep> FindLargeStep(const EstimationInput& input,
                                       const std::vector<PairBlock>& blocks,
                                       const Calibration& calibration, double noise,
                                       const PairGraphOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_TIME_H_
