#include "frontend/track_jumps.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <utility>

#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "frontend/track_cleaner.h"

namespace camgyro {
namespace {

using Eigen::Vector2d;
using Points = std::vector<TrackedPoint>;  // of a frame, by ascending id
using Motion = std::optional<Eigen::Matrix3d>;

constexpr int kLeastMatches = 10;
constexpr double kHomographyPx = 3.0;  // of RANSAC; parallax of a frame interval is in it
// Points of a repeated picture stay where they are; those of a camera at rest move by their noise,
// a hundredth of a pixel or more.
constexpr double kRepeatedPx = 1e-3;
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
Motion CommonMotion(const Points& from, const Points& to) {
  const std::vector<Match> matches = MatchesBetween(from, to);
  if (matches.size() < kLeastMatches) return std::nullopt;
  std::vector<cv::Point2d> a, b;
  std::vector<double> lengths;
  for (const Match& match : matches) {
    a.emplace_back(match.px_a.x(), match.px_a.y());
    b.emplace_back(match.px_b.x(), match.px_b.y());
    lengths.push_back((match.px_b - match.px_a).norm());
  }
  if (MedianInPlace(&lengths) < kRepeatedPx) return std::nullopt;
  const cv::Mat found = cv::findHomography(a, b, cv::RANSAC, kHomographyPx);  // a fixed seed
  if (found.empty()) return std::nullopt;
  Eigen::Matrix3d motion;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) motion(row, column) = found.at<double>(row, column);
  }
  return motion;
}

const TrackedPoint* Find(const Points& points, int64_t id) {
  const auto found =
      std::lower_bound(points.begin(), points.end(), id,
                       [](const TrackedPoint& p, int64_t wanted) { return p.track_id < wanted; });
  return found != points.end() && found->track_id == id ? &*found : nullptr;
}

// How far a point is from where the track's others say that it should be, and how much of that
// may be parallax; by the middle of its neighbours, by the two before, by the two after.
enum Prediction { kMiddle, kBefore, kAfter };
struct Deviation {
  double all = 0.0, allowed = 0.0;
};
using Deviations = std::array<std::optional<Deviation>, 3>;
using Noise = std::array<double, 3>;

// A frame between the two before and the two after it, and the common motions between these: null
// where the recording has none.
class Around {
 public:
  static constexpr size_t kHere = 2;

  void Set(size_t place, const Points* points, const Motion* to_next) {
    points_[place] = points;
    motions_[place] = to_next;
  }

  Deviations DeviationsOf(int64_t id) const {
    const auto before = OwnMotion(0, id), in = OwnMotion(1, id), out = OwnMotion(2, id),
               after = OwnMotion(3, id);
    Deviations deviations;
    if (in && out) deviations[kMiddle] = Change(*in, *out, 0.5);
    if (in && before) deviations[kBefore] = Change(*before, *in, 1.0);
    if (out && after) deviations[kAfter] = Change(*out, *after, 1.0);
    return deviations;
  }

  bool IsOff(const Noise& noise, int64_t id) const { return IsOff(noise, DeviationsOf(id)); }
  static bool IsOff(const Noise& noise, const Deviations& deviations) {
    int known = 0, far = 0;
    for (size_t k = 0; k < 3; ++k) {
      known += deviations[k].has_value();
      far += deviations[k] && IsFar(*deviations[k], noise[k]);
    }
    return known >= 2 && far == known;
  }

  // From the frame before to this one: the line through the two before does not lead here, nor that
  // through this one and the next back there.
  bool Slips(const Noise& noise, int64_t id) const {
    const auto before = OwnMotion(0, id), in = OwnMotion(1, id), out = OwnMotion(2, id);
    return before && in && out && IsFar(Change(*before, *in, 1.0), noise[kBefore]) &&
           IsFar(Change(*in, *out, 1.0), noise[kAfter]);
  }

 private:
  static Deviation Change(const Vector2d& from, const Vector2d& to, double share) {
    return {share * (to - from).norm(),
            share * kChangeOfParallax * std::min(from.norm(), to.norm())};
  }
  static bool IsFar(const Deviation& deviation, double noise) {
    return deviation.all > kJumpSigmas * noise + deviation.allowed;
  }

  // Of a track, from a place to the next, less the common motion. Differences of neighbouring ones
  // are in pixels of pictures that are nearly the same.
  std::optional<Vector2d> OwnMotion(size_t place, int64_t id) const {
    if (points_[place] == nullptr || points_[place + 1] == nullptr || !*motions_[place]) {
      return std::nullopt;
    }
    const TrackedPoint *a = Find(*points_[place], id), *b = Find(*points_[place + 1], id);
    if (a == nullptr || b == nullptr) return std::nullopt;
    return Vector2d(b->px - (**motions_[place] * a->px.homogeneous()).hnormalized());
  }

  std::array<const Points*, 5> points_{};
  std::array<const Motion*, 5> motions_{};
};

double NoiseOf(std::vector<double> lengths) {
  if (lengths.empty()) return 0.0;
  const auto at = lengths.begin() +
                  static_cast<std::ptrdiff_t>(kQuantile * static_cast<double>(lengths.size()));
  std::nth_element(lengths.begin(), at, lengths.end());
  return *at / kLengthAtQuantile;
}

// Of a recording, which may change meanwhile: the motions stay.
class Tracks {
 public:
  explicit Tracks(const std::vector<Points>& frames) : frames_(frames), motions_(frames.size()) {
    ParallelFor(frames.size(), [&](size_t i) {
      if (i + 1 < frames.size()) motions_[i] = CommonMotion(frames[i], frames[i + 1]);
    });
  }

  Around AroundFrame(size_t frame) const {
    Around around;
    for (size_t place = 0; place < 5; ++place) {
      const size_t at = frame + place - Around::kHere;  // wraps below the first frame
      if (at < frames_.size()) around.Set(place, &frames_[at], &motions_[at]);
    }
    return around;
  }

  Noise EstimateNoise() const {
    std::array<std::vector<double>, 3> lengths;
    const size_t stride = std::max<size_t>(1, frames_.size() / kFramesForNoise);
    for (size_t i = 0; i < frames_.size(); i += stride) {
      const Around around = AroundFrame(i);
      for (const TrackedPoint& point : frames_[i]) {
        const Deviations deviations = around.DeviationsOf(point.track_id);
        for (size_t k = 0; k < 3; ++k) {
          if (deviations[k]) lengths[k].push_back(deviations[k]->all);
        }
      }
    }
    Noise noise{};
    for (size_t k = 0; k < 3; ++k) noise[k] = NoiseOf(std::move(lengths[k]));
    return noise;
  }

 private:
  const std::vector<Points>& frames_;
  std::vector<Motion> motions_;
};

// Of tracks that have slipped, by their id: what they are called since.
void Rename(const std::map<int64_t, int64_t>& renamed, Points* points) {
  for (TrackedPoint& point : *points) {
    const auto name = renamed.find(point.track_id);
    if (name != renamed.end()) point.track_id = name->second;
  }
  std::sort(points->begin(), points->end(),
            [](const TrackedPoint& x, const TrackedPoint& y) { return x.track_id < y.track_id; });
}

}  // namespace

TrackJumps RemoveTrackJumps(Recording* recording) {
  std::vector<Points>& frames = recording->tracks;
  const Tracks tracks(frames);
  const Noise noise = tracks.EstimateNoise();
  std::vector<std::vector<bool>> is_off(frames.size()), slips(frames.size());
  ParallelFor(frames.size(), [&](size_t f) {
    const Around around = tracks.AroundFrame(f);
    for (const TrackedPoint& point : frames[f]) {
      is_off[f].push_back(around.IsOff(noise, point.track_id));
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
    const Around around = tracks.AroundFrame(f);
    for (const TrackedPoint& point : frames[f]) {
      slips[f].push_back(around.Slips(noise, point.track_id));
    }
  });
  int64_t next_id = FreeTrackId(frames);
  std::map<int64_t, int64_t> renamed;
  for (size_t f = 0; f < frames.size(); ++f) {
    for (size_t i = 0; i < frames[f].size(); ++i) {
      if (!slips[f][i]) continue;
      ++jumps.cuts;
      renamed[frames[f][i].track_id] = next_id++;
    }
    Rename(renamed, &frames[f]);
  }
  return jumps;
}

std::optional<Points> StreamingTrackJumps::Add(Points points) {
  if (!frames_.empty()) frames_.back().motion = CommonMotion(frames_.back().points, points);
  frames_.emplace_back().points = std::move(points);
  if (frames_.size() < kBehind) return std::nullopt;
  const auto around = [&](size_t frame, Points Frame::*which) {
    Around a;
    for (size_t place = 0; place < 5; ++place) {
      const size_t at = frame + place - Around::kHere;  // wraps below the first frame
      if (at < frames_.size()) a.Set(place, &(frames_[at].*which), &frames_[at].motion);
    }
    return a;
  };

  const size_t tested = frames_.size() - kBehind;  // two have come after it
  Frame& frame = frames_[tested];
  std::vector<Deviations> deviations;
  const Around around_tested = around(tested, &Frame::points);
  for (const TrackedPoint& point : frame.points) {
    deviations.push_back(around_tested.DeviationsOf(point.track_id));
    for (size_t k = 0; k < 3; ++k) {
      if (deviations.back()[k]) frame.deviation[k].push_back(deviations.back()[k]->all);
    }
  }
  Noise noise{};
  for (size_t k = 0; k < 3; ++k) {
    std::vector<double> lengths;
    for (const Frame& f : frames_) {
      lengths.insert(lengths.end(), f.deviation[k].begin(), f.deviation[k].end());
    }
    noise[k] = NoiseOf(std::move(lengths));
  }
  for (size_t i = 0; i < frame.points.size(); ++i) {
    if (!Around::IsOff(noise, deviations[i])) frame.kept.push_back(frame.points[i]);
  }
  jumps_.points += frame.points.size();
  jumps_.off += frame.points.size() - frame.kept.size();
  if (tested == 0) return std::nullopt;

  const size_t known = tested - 1;
  const Around around_known = around(known, &Frame::kept);
  for (const TrackedPoint& point : frames_[known].kept) {
    if (!around_known.Slips(noise, point.track_id)) continue;
    ++jumps_.cuts;
    renamed_[point.track_id] = next_id_ < kLargestCutId ? next_id_++ : next_id_;
  }
  for (auto track = renamed_.begin(); track != renamed_.end();) {
    const bool seen =
        std::any_of(frames_.begin() + static_cast<std::ptrdiff_t>(known), frames_.end(),
                    [&](const Frame& f) { return Find(f.points, track->first) != nullptr; });
    track = seen ? std::next(track) : renamed_.erase(track);
  }
  Points released = frames_[known].kept;
  Rename(renamed_, &released);
  if (frames_.size() > kMemory) frames_.pop_front();
  return released;
}

}  // namespace camgyro
