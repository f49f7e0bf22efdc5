#include "core/recording.h"

#include <algorithm>
#include <array>
#include <cmath>

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

std::vector<bool> FindSaturated(const std::vector<GyroSample>& gyro) {
  std::vector<bool> saturated(gyro.size(), false);
  // Largest value of each axis and sign, and those of them that are rails.
  std::array<double, 6> largest{};
  std::array<bool, 6> is_rail{};
  const auto value = [&](const GyroSample& sample, size_t k) {
    return (k < 3 ? 1.0 : -1.0) * sample.omega_gyro_rad_s[static_cast<Eigen::Index>(k % 3)];
  };
  for (size_t k = 0; k < 6; ++k) {
    for (const GyroSample& sample : gyro) largest[k] = std::max(largest[k], value(sample, k));
    int at = 0, below = 0;
    for (const GyroSample& sample : gyro) {
      const double share = value(sample, k) / largest[k];
      at += share > 1.0 - 1e-6 ? 1 : 0;
      below += share > 0.97 && share <= 1.0 - 1e-6 ? 1 : 0;
    }
    is_rail[k] = largest[k] > 0.5 && at >= 5 && at >= 2 * below;
  }
  for (size_t k = 0; k < 6; ++k) {
    // The rail of another axis counts where this one reaches it, too.
    const bool counts = std::any_of(is_rail.begin(), is_rail.end(), [&](const bool& rail) {
      const double limit = largest[static_cast<size_t>(&rail - is_rail.data())];
      return rail && std::abs(largest[k] - limit) < 1e-6 * limit;
    });
    if (!counts) continue;
    for (size_t i = 0; i < gyro.size(); ++i) {
      if (value(gyro[i], k) > (1.0 - 1e-6) * largest[k]) saturated[i] = true;
    }
  }
  return saturated;
}

}  // namespace camgyro
