#include "frontend/track_recording.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>

#include "core/format.h"
#include "core/robust_statistics.h"
#include "frontend/frame_source.h"
#include "frontend/gyro_rotation.h"
#include "frontend/outliers.h"

namespace camgyro {
namespace {

constexpr double kMinMatches = 8.0;  // per pair, median; 2 go into the translation direction
// Below it, vibration and the tracker's own errors are what one would calibrate on.
// (euroc-v101-rest: 0.15 px, rotors running; gopro-hero5-karma, hardly turning: 0.43 px.)
constexpr double kMinMotionPx = 0.3;
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

std::optional<GyroRotation> RotationBetween(const Recording& recording,
                                            const Calibration* calibration, size_t frame_a) {
  if (calibration == nullptr) return std::nullopt;
  return GyroRotation::Between(recording.gyro, *calibration, recording.frames[frame_a].stamp_ns,
                               recording.frames[frame_a + 1].stamp_ns);
}

// Gives a track a new id from every wrong match on. Returns the share of wrong matches.
double CutTracksAtOutliers(const Calibration* calibration, Recording* recording) {
  int64_t next_id = 0;
  for (const auto& points : recording->tracks) {
    if (!points.empty()) next_id = std::max(next_id, points.back().track_id + 1);
  }
  std::map<int64_t, int64_t> renamed;  // the tracker's id -> ours
  std::vector<std::vector<TrackedPoint>> cut = recording->tracks;
  size_t wrong = 0, all = 0;
  const std::vector<FramePair> pairs = PairsFromTracks(recording->tracks, 1);
  for (size_t i = 0; i < pairs.size(); ++i) {
    const std::optional<GyroRotation> rotation = RotationBetween(*recording, calibration, i);
    const std::vector<bool> inliers =
        rotation ? InliersByEpipolarLine(pairs[i], *rotation)
                 : InliersByHomography(pairs[i], recording->camera.width_px,
                                       recording->camera.height_px);
    // The matches of a pair are in the order of ids, and so are the points of a frame.
    size_t match = 0;
    for (TrackedPoint& point : cut[i + 1]) {
      const FramePair& pair = pairs[i];
      if (match < pair.matches.size() && pair.matches[match].px_b == point.px) {
        if (!inliers[match]) {
          renamed[point.track_id] = next_id++;
          ++wrong;
        }
        ++match;
        ++all;
      }
      const auto found = renamed.find(point.track_id);
      if (found != renamed.end()) point.track_id = found->second;
    }
    std::sort(cut[i + 1].begin(), cut[i + 1].end(),
              [](const TrackedPoint& x, const TrackedPoint& y) { return x.track_id < y.track_id; });
  }
  recording->tracks = std::move(cut);
  return all > 0 ? static_cast<double>(wrong) / static_cast<double>(all) : 0.0;
}

}  // namespace

ImageMotion MeasureImageMotion(const Recording& recording) {
  ImageMotion motion;
  std::vector<double> matches, lengths;
  for (const FramePair& pair :
       recording.matches.empty() ? PairsFromTracks(recording.tracks, 1) : recording.matches) {
    matches.push_back(static_cast<double>(pair.matches.size()));
    for (const Match& match : pair.matches) lengths.push_back((match.px_b - match.px_a).norm());
  }
  motion.pairs = matches.size();
  motion.total_matches = lengths.size();
  if (!matches.empty()) motion.matches = MedianInPlace(&matches);
  if (!lengths.empty()) motion.motion_px = MedianInPlace(&lengths);
  return motion;
}

Status CheckImageMotion(const Recording& recording) {
  const ImageMotion motion = MeasureImageMotion(recording);
  if (motion.matches >= kMinMatches && motion.motion_px >= kMinMotionPx) return {};
  if (motion.matches >= kMinMatches) {
    return CannotEstimate(
        Format("no motion in the recording: features move by %.2f px between frames (median); turn "
               "the camera about all its axes",
               motion.motion_px));
  }
  return CannotEstimate(
      "too few features: a median of " + std::to_string(static_cast<int>(motion.matches)) +
      " matches per pair of frames, at least " + std::to_string(static_cast<int>(kMinMatches)) +
      " are needed (no texture, blur, or frames too far apart?)");
}

Result<TrackingSummary> TrackRecording(const TrackerOptions& options,
                                       const Calibration* calibration,
                                       const TrackingProgress& progress, Recording* recording) {
  const auto begin = std::chrono::steady_clock::now();
  Result<std::unique_ptr<FrameSource>> source = OpenFrames(*recording);
  if (!source) return tl::unexpected(source.error());
  KltTracker tracker(options);
  std::vector<std::vector<TrackedPoint>> tracks;
  cv::Mat gray;
  for (size_t i = 0; i < recording->frames.size(); ++i) {
    const Result<bool> more = (*source)->Next(&gray);
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
    PointPredictor predictor;
    std::optional<GyroRotation> rotation;
    if (i > 0) rotation = RotationBetween(*recording, calibration, i - 1);
    if (rotation) predictor = [&](const Eigen::Vector2d& px) { return rotation->Predict(px); };
    tracks.push_back(tracker.Add(gray, predictor));
    if (progress) progress(static_cast<double>(i + 1) / recording->frames.size());
  }
  recording->tracks = std::move(tracks);
  recording->matches.clear();
  recording->match_noise = MatchNoise::kSecondImage;

  TrackingSummary summary;
  summary.outlier_ratio = CutTracksAtOutliers(calibration, recording);
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (Status enough = CheckImageMotion(*recording); !enough) return tl::unexpected(enough.error());
  return summary;
}

}  // namespace camgyro
