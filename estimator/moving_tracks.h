// Tracks of things that move by themselves.
#ifndef CAMGYRO_ESTIMATOR_MOVING_TRACKS_H_
#define CAMGYRO_ESTIMATOR_MOVING_TRACKS_H_

#include <cstdint>
#include <functional>
#include <vector>

#include "core/calibration.h"
#include "core/result.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"
#include "estimator/window/refinement.h"
#include "estimator/window/track_lean.h"

namespace camgyro {

// Of all tracks with kLeastMatches in the pairs, by ascending id; each as if the calibration were
// right, with the gyro's rates and the direction that suits each pair best. noise: per axis [px].
// latents: of a fit of these pairs, which knows the frames' own times better than each pair by
// itself; null: of none.
std::vector<TrackLean> LeanOfTracks(const EstimationInput& input,
                                    const std::vector<TimedPair>& pairs,
                                    const Calibration& calibration, double noise,
                                    const PairGraphOptions& options,
                                    const PairLatents* latents = nullptr);

// The pairs without the matches of these tracks (ascending ids).
std::vector<TimedPair> WithoutTracks(const std::vector<TimedPair>& pairs,
                                     const std::vector<int64_t>& track_ids);

// A fit without the tracks that move.
struct StillFit {
  Refined fit;
  std::vector<TimedPair> pairs;  // of the last fit; empty if nothing was left out
  int tracks = 0, moving = 0;
};
// The tracks are tested under a fit of all pairs, and again under that of those at rest, until nine
// tenths of them stay the same, or all but 1 % of the matches, at most kMostTests times. `fit`: of
// some pairs, from a start with the noise so far, none for the first. Nothing is left out of
// attitudes, of transfers, of matches without tracks, and without a robust loss. Errors: of the
// first fit; where a later one fails, the one before stands.
using FitOfPairs =
    std::function<Result<Refined>(const std::vector<TimedPair>& pairs, const Refined* before)>;
constexpr int kMostTests = 3;
Result<StillFit> FitWhatIsStill(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                                const PairGraphOptions& options, const FitOfPairs& fit);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_MOVING_TRACKS_H_
