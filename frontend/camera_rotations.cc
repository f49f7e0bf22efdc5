#include "frontend/camera_rotations.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/lens.h"
#include "core/parallel.h"
#include "frontend/two_view_rotation.h"

namespace camgyro {
namespace {

constexpr double kPairS = 0.1;
constexpr int kMinPairs = 30;  // the start asks for 20

// A motion is followed from one focal length to the next if these are no further apart (log), and
// searched anew at every fifth: a wrong one is not followed for long.
constexpr double kFollowedLog = 0.1;
constexpr size_t kSearchEvery = 5;

}  // namespace

std::vector<FramePair> PairsForRotations(const Recording& recording) {
  if (!recording.matches.empty()) return recording.matches;
  const double interval_s = MedianInterval(recording.frames);
  if (!(interval_s > 0.0)) return {};
  const int longest = std::max(1, static_cast<int>(recording.tracks.size()) / kMinPairs);
  const int gap = std::clamp(static_cast<int>(std::lround(kPairS / interval_s)), 1, longest);
  std::vector<FramePair> chain;
  for (FramePair& pair : PairsFromTracks(recording.tracks, gap)) {
    if (pair.frame_a % gap == 0) chain.push_back(std::move(pair));
  }
  return chain;
}

std::vector<FramePair> SpreadPairs(const std::vector<FramePair>& pairs, size_t max_pairs) {
  if (pairs.size() <= max_pairs) return pairs;
  std::vector<FramePair> spread;
  spread.reserve(max_pairs);
  for (size_t i = 0; i < max_pairs; ++i) spread.push_back(pairs[i * pairs.size() / max_pairs]);
  return spread;
}

std::vector<std::vector<CameraRotation>> CameraRotationsOf(const std::vector<FramePair>& pairs,
                                                           const CameraGuess& camera,
                                                           const std::vector<double>& focals_px) {
  const Eigen::Vector2d centre(0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1));
  const Lens& model = GetLens(camera.distortion_model);
  std::vector<LensParameters> lenses;
  for (const double focal_px : focals_px) {
    LensParameters& lens = lenses.emplace_back(
        MakePinhole(focal_px, camera.principal_px.value_or(centre), camera.aspect_ratio));
    for (size_t i = 0; i < std::min<size_t>(camera.distortion.size(), 4); ++i) {
      lens[FirstCoefficient(camera.distortion_model) + static_cast<int>(i)] = camera.distortion[i];
    }
  }
  std::vector<std::vector<std::optional<CameraRotation>>> found(pairs.size());
  ParallelFor(pairs.size(), [&](size_t i) {
    std::optional<TwoViewMotion> motion;
    for (size_t k = 0; k < lenses.size(); ++k) {
      const bool is_near =
          k > 0 && std::abs(std::log(focals_px[k] / focals_px[k - 1])) < kFollowedLog;
      if (!is_near || k % kSearchEvery == 0) motion.reset();
      found[i].push_back(EstimateCameraRotation(pairs[i], model, lenses[k], {}, &motion));
    }
  });
  std::vector<std::vector<CameraRotation>> rotations(lenses.size());
  for (const auto& of_pair : found) {
    for (size_t k = 0; k < lenses.size(); ++k) {
      if (of_pair[k]) rotations[k].push_back(*of_pair[k]);
    }
  }
  return rotations;
}

}  // namespace camgyro
