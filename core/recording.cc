#include "core/recording.h"

#include <algorithm>

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
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return 1e-9 * static_cast<double>(*middle);
}

}  // namespace

std::vector<FramePair> PairsFromTracks(const std::vector<std::vector<TrackedPoint>>& tracks,
                                       int gap) {
  std::vector<FramePair> pairs;
  for (size_t a = 0; a + static_cast<size_t>(gap) < tracks.size(); ++a) {
    const size_t b = a + static_cast<size_t>(gap);
    FramePair pair;
    pair.frame_a = static_cast<int>(a);
    pair.frame_b = static_cast<int>(b);
    auto it_b = tracks[b].begin();
    for (const TrackedPoint& point : tracks[a]) {
      while (it_b != tracks[b].end() && it_b->track_id < point.track_id) ++it_b;
      if (it_b == tracks[b].end()) break;
      if (it_b->track_id == point.track_id) pair.matches.push_back({point.px, it_b->px});
    }
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

double MedianInterval(const std::vector<GyroSample>& gyro) { return MedianIntervalOf(gyro); }
double MedianInterval(const std::vector<Frame>& frames) { return MedianIntervalOf(frames); }

std::vector<bool> FindSaturated(const std::vector<GyroSample>& gyro) {
  std::vector<bool> saturated(gyro.size(), false);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      double rail = 0.0;
      for (const GyroSample& sample : gyro) {
        rail = std::max(rail, sign * sample.omega_gyro_rad_s[axis]);
      }
      int at = 0, below = 0;
      for (const GyroSample& sample : gyro) {
        const double share = sign * sample.omega_gyro_rad_s[axis] / rail;
        if (share > 1.0 - 1e-6) {
          ++at;
        } else if (share > 0.97) {
          ++below;
        }
      }
      if (!(rail > 0.5) || at < 5 || at < 2 * below) continue;
      for (size_t i = 0; i < gyro.size(); ++i) {
        if (sign * gyro[i].omega_gyro_rad_s[axis] > (1.0 - 1e-6) * rail) saturated[i] = true;
      }
    }
  }
  return saturated;
}

}  // namespace camgyro
