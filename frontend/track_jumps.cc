#include "frontend/track_jumps.h"

#include <algorithm>
#include <array>
#include <map>
#include <opencv2/calib3d.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "frontend/track_cleaner.h"

namespace camgyro {
namespace {

using Eigen::Vector2d;
using Points = std::vector<TrackedPoint>;  // of a frame, by ascending id

constexpr int kLeastMatches = 10;
constexpr double kHomographyPx = 3.0;  // of RANSAC; parallax of a frame interval is in it
// So many frames, spread over the recording, say how large the noise is.
constexpr size_t kFramesForNoise = 500;
// The noise is told by this quantile, which up to a third of wrong points leaves among the sound
// ones, though three points make a deviation; of the length of a vector of two Gaussians of unit
// sigma it is sqrt(-2 ln 0.85).
constexpr double kQuantile = 0.15;
constexpr double kLengthAtQuantile = 0.570;
// By so much of itself may the parallax of a sound point change from a frame to the next: that of
// near ones does, where somebody walks.
constexpr double kChangeOfParallax = 0.5;

// The common motion from a frame to the next; nothing where too few tracks tell it.
std::optional<Eigen::Matrix3d> CommonMotion(const Points& from, const Points& to) {
  const std::vector<Match> matches = MatchesBetween(from, to);
  if (matches.size() < kLeastMatches) return std::nullopt;
  std::vector<cv::Point2d> a, b;
  for (const Match& match : matches) {
    a.emplace_back(match.px_a.x(), match.px_a.y());
    b.emplace_back(match.px_b.x(), match.px_b.y());
  }
  const cv::Mat found = cv::findHomography(a, b, cv::RANSAC, kHomographyPx);  // a fixed seed
  if (found.empty()) return std::nullopt;
  Eigen::Matrix3d motion;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) motion(row, column) = found.at<double>(row, column);
  }
  return motion;
}

// Of a recording, which may change meanwhile: the motions stay.
class Tracks {
 public:
  // How far a point is from where the track's others say that it should be, and how much of that
  // may be parallax; by the middle of its neighbours, by the two before, by the two after.
  enum Prediction { kMiddle, kBefore, kAfter };
  struct Deviation {
    double all = 0.0, allowed = 0.0;
  };
  using Deviations = std::array<std::optional<Deviation>, 3>;
  using Noise = std::array<double, 3>;

  explicit Tracks(const std::vector<Points>& frames) : frames_(frames) {
    motions_.resize(frames.size());
    ParallelFor(frames.size(), [&](size_t i) {
      if (i + 1 < frames.size()) motions_[i] = CommonMotion(frames[i], frames[i + 1]);
    });
  }

  Deviations DeviationsOf(size_t frame, int64_t id) const {
    const auto before = OwnMotion(frame, -2, id), in = OwnMotion(frame, -1, id);
    const auto out = OwnMotion(frame, 0, id), after = OwnMotion(frame, 1, id);
    Deviations deviations;
    if (in && out) deviations[kMiddle] = Change(*in, *out, 0.5);
    if (in && before) deviations[kBefore] = Change(*before, *in, 1.0);
    if (out && after) deviations[kAfter] = Change(*out, *after, 1.0);
    return deviations;
  }

  Noise EstimateNoise() const {
    std::array<std::vector<double>, 3> lengths;
    const size_t stride = std::max<size_t>(1, frames_.size() / kFramesForNoise);
    for (size_t i = 0; i < frames_.size(); i += stride) {
      for (const TrackedPoint& point : frames_[i]) {
        const Deviations deviations = DeviationsOf(i, point.track_id);
        for (size_t k = 0; k < 3; ++k) {
          if (deviations[k]) lengths[k].push_back(deviations[k]->all);
        }
      }
    }
    Noise noise{};
    for (size_t k = 0; k < 3; ++k) {
      if (lengths[k].empty()) continue;
      const auto at = lengths[k].begin() + static_cast<std::ptrdiff_t>(
                                               kQuantile * static_cast<double>(lengths[k].size()));
      std::nth_element(lengths[k].begin(), at, lengths[k].end());
      noise[k] = *at / kLengthAtQuantile;
    }
    return noise;
  }

 private:
  static Deviation Change(const Vector2d& from, const Vector2d& to, double share) {
    return {share * (to - from).norm(),
            share * kChangeOfParallax * std::min(from.norm(), to.norm())};
  }

  // Of a track, from frame + step to the frame after that, less the common motion. Differences of
  // neighbouring ones are in pixels of pictures that are nearly the same.
  std::optional<Vector2d> OwnMotion(size_t frame, int step, int64_t id) const {
    const size_t from = frame + static_cast<size_t>(step);  // wraps below the first frame
    if (from + 1 >= frames_.size() || from >= frames_.size() || !motions_[from]) {
      return std::nullopt;
    }
    const TrackedPoint *a = Find(from, id), *b = Find(from + 1, id);
    if (a == nullptr || b == nullptr) return std::nullopt;
    return Vector2d(b->px - (*motions_[from] * a->px.homogeneous()).hnormalized());
  }

  const TrackedPoint* Find(size_t frame, int64_t id) const {
    const Points& points = frames_[frame];
    const auto found =
        std::lower_bound(points.begin(), points.end(), id,
                         [](const TrackedPoint& p, int64_t wanted) { return p.track_id < wanted; });
    return found != points.end() && found->track_id == id ? &*found : nullptr;
  }

  const std::vector<Points>& frames_;
  std::vector<std::optional<Eigen::Matrix3d>> motions_;
};

bool IsFar(const std::optional<Tracks::Deviation>& deviation, double noise) {
  return deviation && deviation->all > kJumpSigmas * noise + deviation->allowed;
}

bool IsOff(const Tracks& tracks, const Tracks::Noise& noise, size_t frame,
           const TrackedPoint& point) {
  const Tracks::Deviations deviations = tracks.DeviationsOf(frame, point.track_id);
  int known = 0, far = 0;
  for (size_t k = 0; k < 3; ++k) {
    known += deviations[k].has_value();
    far += IsFar(deviations[k], noise[k]);
  }
  return known >= 2 && far == known;
}

// Between the frame before and this one.
bool Slips(const Tracks& tracks, const Tracks::Noise& noise, size_t frame,
           const TrackedPoint& point) {
  using T = Tracks;
  return frame > 0 &&
         IsFar(tracks.DeviationsOf(frame, point.track_id)[T::kBefore], noise[T::kBefore]) &&
         IsFar(tracks.DeviationsOf(frame - 1, point.track_id)[T::kAfter], noise[T::kAfter]);
}

}  // namespace

TrackJumps RemoveTrackJumps(Recording* recording) {
  std::vector<Points>& frames = recording->tracks;
  const Tracks tracks(frames);
  const Tracks::Noise noise = tracks.EstimateNoise();
  std::vector<std::vector<bool>> is_off(frames.size()), slips(frames.size());
  ParallelFor(frames.size(), [&](size_t f) {
    for (const TrackedPoint& point : frames[f]) {
      is_off[f].push_back(IsOff(tracks, noise, f, point));
    }
  });
  TrackJumps jumps;
  for (size_t f = 0; f < frames.size(); ++f) {
    Points& points = frames[f];
    size_t kept = 0;  // in their place: a vector that grows holds up to twice its points
    for (size_t i = 0; i < points.size(); ++i) {
      if (!is_off[f][i]) points[kept++] = points[i];
    }
    jumps.points += points.size();
    jumps.off += points.size() - kept;
    points.resize(kept);
  }
  // Now that wrong points contradict nobody any more.
  ParallelFor(frames.size(), [&](size_t f) {
    for (const TrackedPoint& point : frames[f]) {
      slips[f].push_back(Slips(tracks, noise, f, point));
    }
  });
  int64_t next_id = FreeTrackId(frames);
  std::map<int64_t, int64_t> renamed;  // tracks that have slipped
  for (size_t f = 0; f < frames.size(); ++f) {
    for (size_t i = 0; i < frames[f].size(); ++i) {
      int64_t& id = frames[f][i].track_id;
      if (slips[f][i]) {
        ++jumps.cuts;
        renamed[id] = next_id++;
      }
      if (const auto name = renamed.find(id); name != renamed.end()) id = name->second;
    }
    std::sort(frames[f].begin(), frames[f].end(),
              [](const TrackedPoint& x, const TrackedPoint& y) { return x.track_id < y.track_id; });
  }
  return jumps;
}

}  // namespace camgyro
