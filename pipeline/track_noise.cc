#include "pipeline/track_noise.h"

#include <algorithm>
#include <vector>

#include "core/known_camera.h"
#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "core/usual_focal.h"
#include "estimator/window/pair_selection.h"
#include "estimator/window/smooth_motion.h"
#include "frontend/epipolar_misfit.h"

namespace camgyro {
namespace {

// Median over pairs all over the recording [px^2]; negative if none has enough matches.
double OwnVariance(const Recording& recording, size_t gap) {
  constexpr size_t kPairs = 50;
  if (recording.tracks.size() <= gap) return -1.0;
  const size_t usable = recording.tracks.size() - gap;
  const size_t step = std::max<size_t>(1, usable / kPairs);
  const Eigen::Vector2d size_px(recording.camera.width_px, recording.camera.height_px);
  const Calibration camera = KnownCamera(recording.camera, FocalToBeginWith(recording.camera));
  std::vector<double> of_pairs((usable + step - 1) / step, -1.0);
  ParallelFor(of_pairs.size(), [&](size_t k) {
    const std::vector<Match> matches = ThroughPinhole(
        camera, MatchesBetween(recording.tracks[k * step], recording.tracks[k * step + gap]));
    const std::vector<Eigen::Vector2d> corrections_px = EpipolarCorrections(matches);
    if (corrections_px.empty()) return;
    std::vector<Eigen::Vector2d> places_px;
    for (const Match& match : matches) places_px.push_back(match.px_b);
    if (const auto left = SeparateSmooth(places_px, corrections_px, size_px)) {
      of_pairs[k] = left->unsmooth;
    }
  });
  of_pairs.erase(std::remove(of_pairs.begin(), of_pairs.end(), -1.0), of_pairs.end());
  return MedianOr(of_pairs, -1.0);
}

}  // namespace

double GrowthOfTrackNoise(const Recording& recording, int gap) {
  const double near = OwnVariance(recording, 1);
  const double far = OwnVariance(recording, static_cast<size_t>(gap));
  return near > 0.0 && far > 0.0 ? far / near : 0.0;
}

bool TrackNoiseAddsUp(const Recording& recording) {
  const int gap = SelectPairs(recording, kGapLimitsOfPoorStart).gap;
  return gap > 1 && GrowthOfTrackNoise(recording, gap) > kGrowthThatAddsUp;
}

}  // namespace camgyro
