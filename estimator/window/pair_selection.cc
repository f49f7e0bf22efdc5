#include "estimator/window/pair_selection.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/robust_statistics.h"
#include "estimator/window/smooth_motion.h"

namespace camgyro {
namespace {

// Variance of both coordinates together, robust, of pairs all over the recording [px^2]; negative
// if none has enough matches.
double UnsmoothVariance(const Recording& recording, int gap) {
  constexpr size_t kPairs = 100;
  if (recording.tracks.size() <= static_cast<size_t>(gap)) return -1.0;
  const Eigen::Vector2d size_px(recording.camera.width_px, recording.camera.height_px);
  const size_t usable = recording.tracks.size() - static_cast<size_t>(gap);
  const size_t step = std::max<size_t>(1, usable / kPairs);
  std::vector<double> of_pairs;
  for (size_t a = 0; a < usable; a += step) {
    const double variance = UnsmoothVariance(
        MatchesBetween(recording.tracks[a], recording.tracks[a + static_cast<size_t>(gap)]),
        size_px);
    if (variance >= 0.0) of_pairs.push_back(variance);
  }
  return MedianOr(of_pairs, -1.0);
}

}  // namespace

std::vector<int> FirstFrames(const PairSelection& selection, int frames, bool lose_step) {
  const int gap = selection.gap, stride = selection.stride;
  std::vector<int> first;
  if (!lose_step || stride == 1) {
    for (int a = 0; a + gap < frames; a += stride) first.push_back(a);
    return first;
  }
  const bool overlap = !selection.leaves_frames_out();
  // Pairs of a chain tell of their common frames' times together: it is broken less often.
  constexpr int kPairsOfChain = 16;
  const int in_step = overlap ? kPairsInStep : kPairsOfChain;
  int begin = 0;
  for (int stretch = 1; begin + gap < frames; ++stretch) {
    const int end = overlap ? std::min(begin + gap, frames - gap) : begin + 1;
    for (int a = begin; a < end; a += std::max(1, stride / 2)) first.push_back(a);
    begin += overlap ? std::max(2 * gap, stride) : gap;
    if (stretch % in_step == 0) ++begin;
  }
  return first;
}

double ParallaxPerFrame(const Recording& recording, int gap) {
  const double near = UnsmoothVariance(recording, 1), far = UnsmoothVariance(recording, gap);
  if (near < 0.0 || far < 0.0) return std::numeric_limits<double>::infinity();
  // near = noise + p^2, far = noise + (gap p)^2, and a coordinate has half of the noise.
  const double of_frame = std::max(0.0, far - near) / (gap * gap - 1.0);
  const double noise = 0.5 * std::max(1e-12, near - of_frame);
  return std::sqrt(of_frame / noise);
}

PairSelection SelectPairs(const Recording& recording, const GapLimits& limits) {
  // A little more than 0.1 s, so that 3 frames of a camera of 29.95 Hz are not too long.
  constexpr double kLongestS = 0.2, kLongestReanchoredS = 0.101;
  PairSelection selection;
  if (!recording.matches.empty() || recording.tracks.empty()) return selection;
  const bool reanchored = recording.match_noise == MatchNoise::kSecondImage;
  const double interval_s = MedianInterval(recording.frames);
  const int frames = static_cast<int>(recording.tracks.size());
  const auto matches = [&](int gap) {
    size_t count = 0;
    for (size_t b = static_cast<size_t>(gap); b < recording.tracks.size(); ++b) {
      count += CountMatches(recording.tracks[b - static_cast<size_t>(gap)], recording.tracks[b]);
    }
    return static_cast<double>(count);
  };
  const double neighbours = matches(1);
  // Takes the gap if the limits allow it.
  const auto take = [&](int gap, double longest_s) {
    const int stride = reanchored ? gap : 2;
    if (gap > limits.gap || gap * interval_s > longest_s ||
        frames < limits.least_pairs * stride + gap ||
        matches(gap) < kLeastMatchesOfGap * neighbours) {
      return false;
    }
    selection = {gap, stride};
    return true;
  };
  if (reanchored) {
    int gap = 2;
    while (take(gap, kLongestReanchoredS)) ++gap;
    return selection;
  }
  int gap = 3;
  while (take(gap, kLongestS)) gap += 2;
  if (selection.gap < 3) return selection;
  const double parallax = ParallaxPerFrame(recording, selection.gap);
  gap = selection.gap;
  const bool far = gap * parallax < kLeastParallax;
  if (far) {
    const int farthest = std::min(limits.gap, static_cast<int>(limits.far_s / interval_s));
    const bool turns = limits.turn_s < limits.far_s && farthest > gap &&
                       farthest * ParallaxPerFrame(recording, farthest) < kLeastFarParallax;
    const double longest_s = turns ? limits.turn_s : limits.far_s;
    while (gap * parallax < kLeastParallax && take(gap + 2, longest_s)) gap += 2;
  }
  selection.far = far;
  return selection;
}

}  // namespace camgyro
