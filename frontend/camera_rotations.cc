#include "frontend/camera_rotations.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/calibration.h"
#include "core/known_camera.h"
#include "core/lens.h"
#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "core/time.h"
#include "frontend/gyro_rotation.h"
#include "frontend/two_view_rotation.h"

namespace camgyro {
namespace {

constexpr double kPairS = 0.1;
constexpr size_t kMinPairs = 30;   // the start asks for 20
constexpr size_t kFewMatches = 8;  // as CheckImageMotion asks of pairs

// A motion is followed from one focal length to the next if these are no further apart (log).
// Where no gyro says which minimum is the right one, it is searched anew at every fifth: a wrong
// one is not followed for long.
constexpr double kFollowedLog = 0.15;
constexpr size_t kSearchEvery = 5;

constexpr size_t kMatchesOfScan = 60;

// How the gyro turned from one frame to the other. Nothing where it has a hole.
std::optional<GyroRotation> RoughRotation(const Recording& recording, const FramePair& pair,
                                          const RoughAlignment& rough, Calibration camera) {
  const int64_t stamp_a_ns = recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns;
  const int64_t stamp_b_ns = recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns;
  camera.q_gyro_cam = rough.q_gyro_cam;
  camera.bias_gyro_rad_s = rough.bias_gyro_rad_s;
  camera.readout_s = rough.readout_s;
  camera.delay_s = rough.delay_middle_row_s - 0.5 * rough.readout_s +
                   rough.clock_skew * SecondsSince(recording.gyro.front().stamp_ns, stamp_a_ns);
  return GyroRotation::Between(recording.gyro, camera, stamp_a_ns, stamp_b_ns);
}

// A logged shift of the lens, taken out of pairs: each match as if the lens had been at rest. The
// log's own scale and time are good enough for rotations.
class LensAtRest {
 public:
  explicit LensAtRest(const Recording& recording)
      : recording_(recording),
        shift_(recording.lens_shift, recording.frames.front().stamp_ns),
        usual_readout_s_(recording.camera.readout_s.value_or(
            0.5 * std::min(1.0 / 30.0, MedianInterval(recording.frames)))) {}

  FramePair Of(FramePair pair, const RotationTrial& trial) const {
    const double readout_s = trial.rough ? trial.rough->readout_s : usual_readout_s_;
    const auto put_back = [&](int frame, Eigen::Vector2d* px) {
      const double time_s = SecondsSince(recording_.frames.front().stamp_ns,
                                         recording_.frames[static_cast<size_t>(frame)].stamp_ns);
      *px -= shift_.At(time_s + readout_s * px->y() / recording_.camera.height_px);
    };
    for (Match& match : pair.matches) {
      put_back(pair.frame_a, &match.px_a);
      put_back(pair.frame_b, &match.px_b);
    }
    return pair;
  }

 private:
  const Recording& recording_;
  const LensShift shift_;
  const double usual_readout_s_;
};

// The usual gap between frames, or the longest shorter one at which some have matches enough:
// tracks may be short-lived.
size_t GapWithMatches(const std::vector<std::vector<TrackedPoint>>& tracks, size_t usual) {
  constexpr size_t kPairs = 100;
  for (size_t gap = usual; gap > 0; --gap) {
    std::vector<size_t> counts;
    for (const size_t a : SpreadIndices(tracks.size() > gap ? tracks.size() - gap : 0, kPairs)) {
      counts.push_back(CountMatches(tracks[a], tracks[a + gap]));
    }
    if (!counts.empty() && MedianInPlace(&counts) >= kFewMatches) return gap;
  }
  return usual;
}

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
  const size_t gap = GapWithMatches(
      recording.tracks,
      std::clamp(static_cast<size_t>(std::lround(kPairS / interval_s)), size_t{1}, longest));
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

FramePair Thinned(const FramePair& pair, size_t most) {
  FramePair thinned{pair.frame_a, pair.frame_b, {}};
  for (const size_t i : SpreadIndices(pair.matches.size(), most)) {
    thinned.matches.push_back(pair.matches[i]);
  }
  return thinned;
}

std::vector<std::vector<CameraRotation>> CameraRotationsOf(
    const Recording& recording, const std::vector<FramePair>& pairs,
    const std::vector<RotationTrial>& trials) {
  if (trials.empty()) return {};
  std::vector<Calibration> cameras;
  for (const RotationTrial& trial : trials) {
    cameras.push_back(KnownCamera(recording.camera, trial.focal_px));
  }
  const Lens& model = GetLens(cameras.front().distortion_model);
  const size_t most = trials.size() > 1 ? kMatchesOfScan : std::numeric_limits<size_t>::max();
  std::optional<LensAtRest> lens_at_rest;
  if (!recording.lens_shift.empty()) lens_at_rest.emplace(recording);
  std::vector<std::vector<std::optional<CameraRotation>>> found(pairs.size());
  ParallelFor(pairs.size(), [&](size_t i) {
    const FramePair seen = Thinned(pairs[i], most);
    FramePair pair = seen;
    std::optional<TwoViewMotion> motion;
    for (size_t k = 0; k < trials.size(); ++k) {
      if (lens_at_rest) pair = lens_at_rest->Of(seen, trials[k]);
      std::optional<GyroRotation> gyro;
      if (trials[k].rough) gyro = RoughRotation(recording, pair, *trials[k].rough, cameras[k]);
      const bool is_near =
          k > 0 && std::abs(std::log(trials[k].focal_px / trials[k - 1].focal_px)) < kFollowedLog;
      if (!is_near || (!gyro && k % kSearchEvery == 0)) motion.reset();
      found[i].push_back(gyro ? EstimateCameraRotation(pair, *gyro)
                              : EstimateCameraRotation(pair, model, cameras[k].lens, {}, &motion));
    }
  });
  std::vector<std::vector<CameraRotation>> rotations(trials.size());
  for (const auto& of_pair : found) {
    for (size_t k = 0; k < trials.size(); ++k) {
      if (of_pair[k]) rotations[k].push_back(*of_pair[k]);
    }
  }
  return rotations;
}

}  // namespace camgyro
