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

std::vector<CameraRotation> CameraRotationsOf(const std::vector<FramePair>& pairs,
                                              const CameraGuess& camera, double focal_px) {
  const Eigen::Vector2d centre(0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1));
  LensParameters lens =
      MakePinhole(focal_px, camera.principal_px.value_or(centre), camera.aspect_ratio);
  for (size_t i = 0; i < std::min<size_t>(camera.distortion.size(), 4); ++i) {
    lens[FirstCoefficient(camera.distortion_model) + static_cast<int>(i)] = camera.distortion[i];
  }
  const Lens& model = GetLens(camera.distortion_model);
  std::vector<std::optional<CameraRotation>> found(pairs.size());
  ParallelFor(pairs.size(),
              [&](size_t i) { found[i] = EstimateCameraRotation(pairs[i], model, lens); });
  std::vector<CameraRotation> rotations;
  rotations.reserve(pairs.size());
  for (const auto& rotation : found) {
    if (rotation) rotations.push_back(*rotation);
  }
  return rotations;
}

}  // namespace camgyro
