// The plane of a pair of frames and the times of its two frames, by its own matches alone.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_FIT_PAIR_H_
#define CAMGYRO_ESTIMATOR_WINDOW_FIT_PAIR_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/frame_times.h"
#include "estimator/window/pair_graph_options.h"
#include "estimator/window/pair_view.h"

namespace camgyro {

// ViewPair and FitPlane; where frames have times of their own (frame_stamp_jitter), at those that
// are given as offsets from the two stamps [s], or else those that the same matches tell:
// measurement.frame_a and frame_b of the view have the offsets. False also for fewer than
// PairGraph::kMinMatches.
[[nodiscard]] bool FitPair(const EstimationInput& input, const TimedPair& pair,
                           const Calibration& calibration, double noise_px,
                           const PairGraphOptions& options, PairView* view, PairPlane* plane,
                           size_t first = 0, size_t step = 1,
                           const std::optional<Eigen::Vector2d>& times_s = std::nullopt);
// What a pair's own matches say of the times of its frames (frame_stamp_jitter), at those that
// FitPair finds, the gyro taken for exact. False where FitPair is.
[[nodiscard]] bool TimesOfPairAlone(const EstimationInput& input, const TimedPair& pair,
                                    const Calibration& calibration, double noise_px,
                                    const PairGraphOptions& options, PairTimes* times);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_FIT_PAIR_H_
