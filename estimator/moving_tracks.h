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

namespace camgyro {

// How far the residuals of a track keep to one side. Noise falls on either side of the epipolar
// line in each pair of frames anew; what moves goes on in its direction, also where no single
// residual is large enough for the robust loss.
//
//   chi2 = S' C^-1 S,   S = sum psi(r_i) u_i,   C = v sum u_i u_i'
//
// r_i: residual of the track in pair i in sigmas, psi: bounded at kBound, u_i: unit vector across
// the epipolar line in the picture, v: mean of psi^2 over all matches, so that neither the noise
// nor its shape has to be known. Of a point at rest it is chi-square with two degrees of freedom.
// Short tracks have lighter tails, as psi is bounded.
struct TrackLean {
  // In sigmas. Lower bounds let wrong matches of points at rest say less, higher ones tell short
  // tracks of things that move; at 1.5 a mean of Gaussian residuals loses 4 % (Huber 1964).
  static constexpr double kBound = 1.5;
  static constexpr int kLeastMatches = 4;  // fewer say nothing

  int64_t track_id = 0;
  int matches = 0;
  double chi2 = 0.0;
};

// Of all tracks with kLeastMatches in the pairs, by ascending id; each as if the calibration were
// right, with the gyro's rates and the direction that suits each pair best. noise: per axis [px].
std::vector<TrackLean> LeanOfTracks(const EstimationInput& input,
                                    const std::vector<TimedPair>& pairs,
                                    const Calibration& calibration, double noise,
                                    const PairGraphOptions& options);

// Ids, ascending, of tracks that lean beyond chance: of those named, a share of kFalseDiscoveries
// is expected to be at rest (Benjamini & Hochberg 1995); of a scene at rest, most often none is
// named. What lets all tracks lean, an effect that nobody has declared, is no motion: chi2 is
// divided by as much as its lower quartile is too large ("genomic control", Devlin & Roeder 1999).
// The lower one: half of the scene may move. None where more than that do; then it is the model.
constexpr double kFalseDiscoveries = 0.05;
constexpr double kMostMoving = 0.5;
std::vector<int64_t> MovingTracks(const std::vector<TrackLean>& leans);

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
// tenths of them stay the same, at most kMostTests times. `fit`: of some pairs, from a start with
// the noise so far, none for the first. Nothing is left out of attitudes, of transfers, of matches
// without tracks, and without a robust loss. Errors: of the first fit; where a later one fails, the
// one before stands.
using FitOfPairs =
    std::function<Result<Refined>(const std::vector<TimedPair>& pairs, const Refined* before)>;
constexpr int kMostTests = 3;
Result<StillFit> FitWhatIsStill(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                                const PairGraphOptions& options, const FitOfPairs& fit);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_MOVING_TRACKS_H_
