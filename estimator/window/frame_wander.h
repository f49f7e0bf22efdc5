// Times that frames have of their own and that wander slowly, as those of a camera do whose
// exposure control moves them.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_FRAME_WANDER_H_
#define CAMGYRO_ESTIMATOR_WINDOW_FRAME_WANDER_H_

#include <string>
#include <vector>

#include "estimator/window/frame_times.h"

namespace camgyro {

// Offsets of frames from their stamps: each has a white part of its own, and all share a slow one,
// a first-order Gauss-Markov process, whose correlation falls as exp(-time apart / time_s). White
// offsets average out over the frames, slow ones do not: the delay, which is the frames' mean, is
// known by as much less.
struct FrameWander {
  double white_s = 0.0, slow_s = 0.0;  // standard deviations
  double time_s = 0.0;                 // correlation time of the slow part
  double two_log_likelihood = 0.0;     // beyond that of the most likely white offsets
};

// 2 log L of the offsets, which are integrated out, as TwoLogLikelihood of frame_times.h has it for
// white ones. Frames' numbers are their times in ns (PairGraph::FrameNumber).
double TwoLogLikelihood(const std::vector<PairTimes>& pairs, const FrameWander& wander);

// The most likely wander; none (slow_s and time_s are 0) where it is not more likely than white
// offsets by what chance gives to its two parameters in one case of a hundred.
// white_s: the most likely spread of frames that are not late. Here and below, late frames wander
// as the others do, and their white part is kMostSpreadS.
FrameWander MostLikelyWander(const std::vector<PairTimes>& pairs, double white_s,
                             const LateFrames& late = {});

// Mean and standard deviation of each frame's offset given the wander, in the order of frames:
// where the matches say little of a frame, it is near its neighbours, not near zero.
std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, const FrameWander& wander,
                                   const LateFrames& late = {});

// Variance of a shift that all frames share, if nothing but their offsets hides it [s^2].
double VarianceOfShift(const std::vector<PairTimes>& pairs, const FrameWander& wander,
                       const LateFrames& late = {});

// What a wander is, in a sentence.
std::string Describe(const FrameWander& wander);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_FRAME_WANDER_H_
