#include "core/recording.h"

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
      if (it_b->track_id == point.track_id) {
        pair.matches.push_back({point.px, it_b->px, it_b->noise_factor});
      }
    }
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

double MedianInterval(const std::vector<GyroSample>& gyro) { return MedianIntervalOf(gyro); }
double MedianInterval(const std::vector<Frame>& frames) { return MedianIntervalOf(frames); }

}  // namespace camgyro
