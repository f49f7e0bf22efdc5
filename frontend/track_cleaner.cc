#include "frontend/track_cleaner.h"

#include <algorithm>
#include <utility>

#include "frontend/outliers.h"

namespace camgyro {
namespace {

// What an error of the calibration moves a feature from its epipolar line, apart from noise.
constexpr double kConsensusSigmaPx = 0.5;

std::vector<bool> InliersByHomography(const FramePair& pair, int width_px, int height_px) {
  FramePair kept = pair;
  RejectByBinHomography(kept, width_px, height_px);
  std::vector<bool> inliers(pair.matches.size(), false);
  size_t next = 0;  // the kept ones are in the order of all
  for (size_t i = 0; i < pair.matches.size() && next < kept.matches.size(); ++i) {
    if (pair.matches[i].px_a == kept.matches[next].px_a &&
        pair.matches[i].px_b == kept.matches[next].px_b) {
      inliers[i] = true;
      ++next;
    }
  }
  return inliers;
}

std::vector<bool> InliersByEpipolarLine(const FramePair& pair, const GyroRotation& rotation) {
  std::vector<RotatedMatch> rotated;
  std::vector<size_t> indices;
  for (size_t i = 0; i < pair.matches.size(); ++i) {
    if (const auto match = rotation.Rotate(pair.matches[i])) {
      rotated.push_back(*match);
      indices.push_back(i);
    }
  }
  TranslationConsensusOptions options;
  options.sigma_px = kConsensusSigmaPx;
  const TranslationConsensus consensus = FindTranslationConsensus(rotated, options);
  std::vector<bool> inliers(pair.matches.size(), false);
  for (size_t k = 0; k < indices.size(); ++k) inliers[indices[k]] = consensus.inliers[k];
  return inliers;
}

}  // namespace

int64_t FreeTrackId(const std::vector<std::vector<TrackedPoint>>& tracks) {
  int64_t free = 0;
  for (const std::vector<TrackedPoint>& points : tracks) {
    if (!points.empty()) free = std::max(free, points.back().track_id + 1);
  }
  return free;
}

std::vector<TrackedPoint> TrackCleaner::Add(const std::vector<TrackedPoint>& points,
                                            const std::optional<GyroRotation>& rotation) {
  FramePair pair;
  pair.matches = MatchesBetween(before_, points);
  const std::vector<bool> inliers = rotation ? InliersByEpipolarLine(pair, *rotation)
                                             : InliersByHomography(pair, width_px_, height_px_);
  before_ = points;
  std::map<int64_t, int64_t> renamed;
  std::vector<TrackedPoint> cleaned = points;
  size_t match = 0;  // in the order of ids, as the points are
  for (TrackedPoint& point : cleaned) {
    const int64_t tracker_id = point.track_id;
    const auto found = renamed_.find(tracker_id);
    if (found != renamed_.end()) point.track_id = found->second;
    if (match < pair.matches.size() && pair.matches[match].px_b == point.px) {
      if (!inliers[match]) {
        point.track_id = next_id_++;
        ++wrong_;
      }
      ++match;
      ++all_;
    }
    if (point.track_id != tracker_id) renamed.emplace(tracker_id, point.track_id);
  }
  renamed_ = std::move(renamed);
  std::sort(cleaned.begin(), cleaned.end(),
            [](const TrackedPoint& x, const TrackedPoint& y) { return x.track_id < y.track_id; });
  return cleaned;
}

}  // namespace camgyro
