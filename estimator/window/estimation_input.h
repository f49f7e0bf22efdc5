// A recording as the estimators see it: gyro rates and pairs of frames on one time axis.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_ESTIMATION_INPUT_H_
#define CAMGYRO_ESTIMATOR_WINDOW_ESTIMATION_INPUT_H_

#include <cstdint>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "estimator/window/timed_pair.h"

namespace camgyro {

// Times are seconds from origin_ns.
struct EstimationInput {
  int64_t origin_ns = 0;  // the first gyro stamp; camera stamps are counted from it as they are
  std::vector<TimedRate> rates;
  std::vector<TimedPair> pairs;
};

// Which frames of tracks make a pair: a and a + gap, for every stride-th a.
struct PairSelection {
  int gap = 1;
  int stride = 1;

  // Odd gaps from every second frame have every frame; pairs one after the other have their ends.
  bool leaves_frames_out() const { return gap > 1 && stride == gap; }
};

constexpr double kLeastMatchesOfGap = 0.6;  // of the neighbours' matches

// The pairs to estimate from. Parallax and rotation grow with the gap and the noise of an
// observation does not, so that neighbours tell least, and are biased where their parallax is as
// small as the noise (docs/lab/benchmark.md). The gap is the longest up to 0.2 s that keeps 60 % of
// the neighbours' matches and leaves `least_pairs`. No two pairs share noise: gaps are odd and
// pairs begin at even frames, so that every observation is in one pair. Neighbours without tracks.
//
// Where a tracker re-anchors at every frame (MatchNoise::kSecondImage), the error of a gap is the
// sum of those of its frames: it grows as the root of the gap, slower than what is to be seen, and
// each frame's is in one pair if a pair begins where the one before has ended. The longest gap is
// 0.1 s there: up to it, sigmas are about those of neighbours, in a half to two thirds of the time,
// and beyond it they grow (docs/lab/pairs.md).
PairSelection SelectPairs(const Recording& recording, int longest_gap = 10, int least_pairs = 100);

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

// Pairs of which none begins before the one before ends, for estimators that go along.
std::vector<TimedPair> SideBySide(const std::vector<TimedPair>& pairs);

// The delay of a frame with the effects, in the middle of its picture [s].
double DelayOf(const Calibration& calibration, const FrameTime& frame);

// What effects may know of a recording, with what a calibration says of it so far.
EffectSetup MakeEffectSetup(const Recording& recording, const Calibration& calibration);

// White noise of one gyro sample per axis [rad/s]: as declared, else what the samples show while
// the camera ran (third differences, robust), within [5e-4, 2e-2]. What vibration and sampling add
// is not in it.
Eigen::Vector3d GyroSigma(const Recording& recording, double delay_s);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_ESTIMATION_INPUT_H_
