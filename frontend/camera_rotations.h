// Camera rotations of a recording at a trial focal length: what the start asks for.
#ifndef CAMGYRO_FRONTEND_CAMERA_ROTATIONS_H_
#define CAMGYRO_FRONTEND_CAMERA_ROTATIONS_H_

#include <cstddef>
#include <limits>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Pairs of frames for rotations, each starting where the one before ends: from tracks, about 0.1 s
// apart (less in recordings so short that few pairs would remain); from matches, as they are. Empty
// without image motion.
//
// Rotation grows with the time between the frames, noise does not, but detail of the motion gets
// lost. FindStart on ov_handheld_gs (lens known, truth 30 ms), and on gopro-hero5-karma (f 540 px):
//   interval [s]                 0.033   0.066   0.1     0.133   0.2     0.3
//   delay, error [ms]           -0.05   -0.06    0.03    0.01   -0.09   -0.12
//   its sigma [ms]               0.22    0.12    0.09    0.09    0.09    0.10
//   karma: explained [%]         67      75      89      61      88      -
// At most `max_pairs` of them, evenly spread.
std::vector<FramePair> PairsForRotations(const Recording& recording,
                                         size_t max_pairs = std::numeric_limits<size_t>::max());

// At most `most` of the numbers below `count`, evenly spread.
std::vector<size_t> SpreadIndices(size_t count, size_t most);

// A pair with at most `most` of its matches, evenly spread.
FramePair Thinned(const FramePair& pair, size_t most);

// EstimateCameraRotation (two_view_rotation.h) of each pair in each trial, with the recording's
// lens, declared or found in its matches (CameraGuess::division_lambda), and without the
// shift of the lens that was logged, for every trial those pairs whose rotation can be found.
// Trials some per cent of the focal length apart, one after the other, share most of the work, and
// where there are several they take at most 60 matches of each pair: they are for finding out which
// one fits.
std::vector<std::vector<CameraRotation>> CameraRotationsOf(
    const Recording& recording, const std::vector<FramePair>& pairs,
    const std::vector<RotationTrial>& trials);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_CAMERA_ROTATIONS_H_
