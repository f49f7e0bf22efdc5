#include "core/recording.h"

#include <utility>

#include "core/robust_statistics.h"
#include "core/time.h"

namespace camgyro {
namespace {

template <typename Stamped>
double MedianIntervalOf(const std::vector<Stamped>& items) {
  if (items.size() < 2) return 0.0;
  std::vector<int64_t> intervals;
  intervals.reserve(items.size() - 1);
  for (size_t i = 1; i < items.size(); ++i) {
    intervals.push_back(items[i].stamp_ns - items[i - 1].stamp_ns);
  }
  return 1e-9 * static_cast<double>(MedianInPlace(&intervals));
}

// Calls take(point of a, point of b) for the tracks seen in both, by ascending id.
template <typename Take>
void ForEachCommon(const std::vector<TrackedPoint>& a, const std::vector<TrackedPoint>& b,
                   const Take& take) {
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (i->track_id == j->track_id) {
      take(*i, *j);
      ++i, ++j;
    } else {
      i->track_id < j->track_id ? ++i : ++j;
    }
  }
}

}  // namespace

std::vector<Match> MatchesBetween(const std::vector<TrackedPoint>& a,
                                  const std::vector<TrackedPoint>& b) {
  std::vector<Match> matches;
  matches.reserve(CountMatches(a, b));
  ForEachCommon(a, b, [&](const TrackedPoint& x, const TrackedPoint& y) {
    matches.push_back({x.px, y.px, y.noise_factor.cast<double>(), x.track_id});
  });
  return matches;
}

size_t CountMatches(const std::vector<TrackedPoint>& a, const std::vector<TrackedPoint>& b) {
  size_t count = 0;
  ForEachCommon(a, b, [&](const TrackedPoint&, const TrackedPoint&) { ++count; });
  return count;
}

std::vector<FramePair> PairsFromTracks(const std::vector<std::vector<TrackedPoint>>& tracks,
                                       int gap) {
  std::vector<FramePair> pairs;
  for (size_t a = 0; a + static_cast<size_t>(gap) < tracks.size(); ++a) {
    const size_t b = a + static_cast<size_t>(gap);
    FramePair pair;
    pair.frame_a = static_cast<int>(a);
    pair.frame_b = static_cast<int>(b);
    pair.matches = MatchesBetween(tracks[a], tracks[b]);
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

void LeaveOutFrames(const std::vector<int>& left_out, bool repeats, Recording* recording) {
  if (left_out.empty()) return;
  constexpr int kNone = -1;
  std::vector<int> moved(recording->frames.size());  // new index, or kNone
  size_t kept = 0, next = 0;
  for (size_t i = 0; i < moved.size(); ++i) {
    Frame& frame = recording->frames[i];
    if (frame.picture < 0) frame.picture = static_cast<int>(i);
    if (next < left_out.size() && left_out[next] == static_cast<int>(i)) {
      ++next;
      moved[i] = repeats ? static_cast<int>(kept) - 1 : kNone;
      continue;
    }
    moved[i] = static_cast<int>(kept);
    if (kept < i) {
      recording->frames[kept] = std::move(frame);
      if (!recording->tracks.empty()) recording->tracks[kept] = std::move(recording->tracks[i]);
      if (!recording->q_cam_world.empty()) recording->q_cam_world[kept] = recording->q_cam_world[i];
    }
    ++kept;
  }
  recording->frames.resize(kept);
  if (!recording->tracks.empty()) recording->tracks.resize(kept);
  if (!recording->q_cam_world.empty()) recording->q_cam_world.resize(kept);
  std::vector<FramePair> pairs;
  for (FramePair& pair : recording->matches) {
    pair.frame_a = moved[static_cast<size_t>(pair.frame_a)];
    pair.frame_b = moved[static_cast<size_t>(pair.frame_b)];
    if (pair.frame_a != kNone && pair.frame_a < pair.frame_b) pairs.push_back(std::move(pair));
  }
  recording->matches = std::move(pairs);
}

double MedianInterval(const std::vector<GyroSample>& gyro) { return MedianIntervalOf(gyro); }
double MedianInterval(const std::vector<Frame>& frames) { return MedianIntervalOf(frames); }

}  // namespace camgyro
