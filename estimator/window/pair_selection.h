// Which frames of a recording's tracks make a pair.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PAIR_SELECTION_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PAIR_SELECTION_H_

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Frames a and a + gap, for every stride-th a.
struct PairSelection {
  int gap = 1;
  int stride = 1;
  // Things are so far, or so equally far, that parallaxes differ by less than kLeastParallax where
  // nothing else limits the gap.
  bool far = false;
  // The same pairs, as if of near things.
  PairSelection near() const { return {gap, stride}; }

  // Odd gaps from every second frame have every frame; pairs one after the other have their ends.
  bool leaves_frames_out() const { return gap > 1 && stride == gap; }
};

// Where stamps are not a steady clock's, a frame is left out after so many pairs, or stretches of
// pairs that overlap. Pairs that begin at every sixth frame, say, would always see the same of what
// repeats with every second or third one, as stamps that are rounded to 5 ms do at 30 frames/s: no
// scatter, but an error of focal length and delay.
constexpr int kPairsInStep = 3;
inline bool PairsLoseTheirStep(const std::optional<StampReport>& camera_stamps) {
  return camera_stamps && camera_stamps->kind != StampKind::kMeasured;
}

// The first frames of the pairs in a recording of so many frames, ascending: every stride-th one,
// or, where pairs lose their step, in stretches of twice the gap, whose first half is paired with
// the second one. An odd gap from even frames alone would always lead to an odd one; where every
// other stamp is late, all pairs would be longer than they say, or all shorter
// (docs/lab/pairs.md#stamps-that-alternate). A chain (leaves_frames_out) stays one, with a frame
// left out more rarely; other pairs have no frame in common then either.
std::vector<int> FirstFrames(const PairSelection& selection, int frames, bool lose_step);

constexpr double kLeastMatchesOfGap = 0.6;  // of the neighbours' matches

struct GapLimits {
  int gap = std::numeric_limits<int>::max();
  int least_pairs = 100;  // that the gap has to leave
  // Where parallax is small. Beyond, too few tracks last, and t_r and t_d lose more than the rest
  // gains (docs/lab/pairs.md).
  double far_s = 0.8;
  // Where they do not differ over that time either (kLeastFarParallax), since the camera only
  // turns.
  double turn_s = 0.8;
};
// Of estimators that go along: pairs that do not overlap are few, if they are long, which costs a
// camera that only turns more than it gains (docs/lab/pairs.md).
constexpr GapLimits kGapLimitsOnline{std::numeric_limits<int>::max(), 100, 0.8, 0.3};
// From a start that may be poor, for PairSelection::near: long pairs more often lead elsewhere
// (docs/lab/pairs.md, "Online").
constexpr GapLimits kGapLimitsOfPoorStart{std::numeric_limits<int>::max(), 100, 0.3, 0.3};

// The pairs to estimate from. Parallax and rotation grow with the gap and the noise of an
// observation does not, so that neighbours tell least, and are biased where their parallax is as
// small as the noise (docs/lab/benchmark.md). The gap is the longest up to 0.2 s that
// keeps 60 % of the neighbours' matches and leaves enough pairs; where things are so far away, or
// so equally far, that parallaxes differ by less than kLeastParallax there, the shortest gap at
// which they do, or as long as the limits allow. No two pairs share noise: gaps are odd and pairs
// begin at even frames (but see FirstFrames), so that every observation is in one pair. Neighbours
// without tracks.
//
// Where a tracker re-anchors at every frame (MatchNoise::kSecondImage), the error of a gap is the
// sum of those of its frames: it grows as the root of the gap, slower than what is to be seen, and
// each frame's is in one pair if a pair begins where the one before has ended. The longest gap is
// 0.1 s there: up to it, sigmas are about those of neighbours, in a half to two thirds of the time,
// and beyond it they grow (docs/lab/pairs.md).
PairSelection SelectPairs(const Recording& recording, const GapLimits& limits = {});

// By how much parallaxes of a pair should differ [standard deviation, in noise of a displacement].
constexpr double kLeastParallax = 2.0;
// What differs by less over GapLimits::far_s has no parallax. Simulated: 0.6 and more of points at
// 45 to 55 m, walking past; at most 0.2 of a turn on the spot.
constexpr double kLeastFarParallax = 0.4;

// By how much parallaxes differ for each frame of a gap, likewise. It is found without a
// calibration, from tracks whose observations have errors of their own: UnsmoothVariance over `gap`
// frames (at least 2) less that between neighbours. Infinite where no pair has enough matches.
double ParallaxPerFrame(const Recording& recording, int gap);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PAIR_SELECTION_H_
