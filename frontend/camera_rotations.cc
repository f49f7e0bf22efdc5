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
constexpr size_t kMinPairs = 30;  // the start asks for 20

// A motion is followed from one focal length to the next if these are no further apart (log), and
// searched anew at every fifth: a wrong one is not followed for long.
constexpr double kFollowedLog = 0.1;
constexpr size_t kSearchEvery = 5;

}  // namespace

std::vector<FramePair> PairsForRotations(const Recording& recording, size_t max_pairs) {
  std::vector<FramePair> pairs;
  if (!recording.matches.empty()) {
    for (const size_t i : SpreadIndices(recording.matches.size(), max_pairs)) {
      pairs.push_back(recording.matches[i]);
    }
    return pairs;
  }
  const double interval_s = MedianInterval(recording.frames);
  if (!(interval_s > 0.0)) return {};
  const size_t frames = recording.tracks.size();
  const size_t longest = std::max<size_t>(1, frames / kMinPairs);
  const size_t gap =
      std::clamp(static_cast<size_t>(std::lround(kPairS / interval_s)), size_t{1}, longest);
  for (const size_t i : SpreadIndices(frames > gap ? (frames - 1) / gap : 0, max_pairs)) {
    const size_t a = i * gap, b = a + gap;
    pairs.push_back({static_cast<int>(a), static_cast<int>(b),
                     MatchesBetween(recording.tracks[a], recording.tracks[b])});
  }
  return pairs;
}

std::vector<size_t> SpreadIndices(size_t count, size_t most) {
  std::vector<size_t> spread(std::min(count, most));
  for (size_t i = 0; i < spread.size(); ++i) {
    spread[i] = count <= most ? i : i * count / most;
  }
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
