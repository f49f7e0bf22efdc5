// What the errors of tracks are like that somebody else has made.
#ifndef CAMGYRO_PIPELINE_TRACK_NOISE_H_
#define CAMGYRO_PIPELINE_TRACK_NOISE_H_

#include "core/recording.h"

namespace camgyro {

// Variance of each point's own error over `gap` frames, over that between neighbours: 1 where each
// observation has an error of its own, `gap` where a tracker re-anchors at every frame, so that the
// errors of a track add up. Of some 50 pairs of each; each point's own is what is off its
// epipolar line (EpipolarCorrections) and no smooth function of the place (SeparateSmooth), so that
// neither parallax nor lens, shutter and turns are in it. A strong lens bends near things more than
// far ones, which is not smooth: it has to be known (declared, or CameraGuess::division_lambda). 0
// where there are too few matches.
double GrowthOfTrackNoise(const Recording& recording, int gap);

// Beyond it, more than half of the error of a pair adds up over its frames.
constexpr double kGrowthThatAddsUp = 2.0;

// Whether it does over the gap of the pairs that would be taken (SelectPairs). False for
// recordings whose tracks make no such pairs.
bool TrackNoiseAddsUp(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_TRACK_NOISE_H_
