// A recording as the estimators see it: gyro rates and pairs of frames on one time axis.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_ESTIMATION_INPUT_H_
#define CAMGYRO_ESTIMATOR_WINDOW_ESTIMATION_INPUT_H_

#include <cstdint>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "estimator/window/pair_selection.h"
#include "estimator/window/timed_pair.h"

namespace camgyro {

// Times are seconds from origin_ns.
struct EstimationInput {
  int64_t origin_ns = 0;  // the first gyro stamp; camera stamps are counted from it as they are
  std::vector<TimedRate> rates;
  std::vector<TimedPair> pairs;
};

// Pairs from matches, tracks (which of them: `selection`) or attitudes. Matches come in the pairs
// that the file has. Attitudes are taken of neighbours. (Further apart they move the delay:
// tablet-attitude D03 by 1 ms for each frame.) What is absent gives no pairs.
EstimationInput MakeEstimationInput(const Recording& recording,
                                    const PairSelection& selection = {});

// The same without the matches, which of all pairs of an hour take more memory than its tracks:
// pairs know how many they are, and AddMatches makes them for those that were chosen.
EstimationInput OutlineOf(const Recording& recording, const PairSelection& selection = {});
std::vector<Match> MatchesOf(const Recording& recording, const TimedPair& pair);
void AddMatches(const Recording& recording, std::vector<TimedPair>* pairs);

// An outline of pairs as of a selection of which none begins before the one before has ended, for
// estimators that go along (kPairsInStep).
std::vector<TimedPair> SideBySide(const Recording& recording, const PairSelection& selection);

// The delay of a frame with the effects, in the middle of its picture; and at its first row and
// column, whose delay t_d is [s].
double DelayOf(const Calibration& calibration, const FrameTime& frame);
double FirstDelayOf(const Calibration& calibration, const FrameTime& frame);

// What effects may know of a recording, with what a calibration says of it so far.
EffectSetup MakeEffectSetup(const Recording& recording, const Calibration& calibration);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_ESTIMATION_INPUT_H_
