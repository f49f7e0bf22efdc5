#include "frontend/readers/sample_clock.h"

#include <algorithm>
#include <cmath>

#include "core/robust_statistics.h"

namespace camgyro {

Result<SampleClock> FitSampleClock(const std::vector<SampleLump>& lumps) {
  if (lumps.size() < 2) return BadInput("a clock needs at least two telemetry payloads");
  for (size_t i = 1; i < lumps.size(); ++i) {
    if (lumps[i].first_sample <= lumps[i - 1].first_sample) {
      return BadInput("a telemetry payload without samples, or out of order");
    }
  }
  const auto deviation = [&](const SampleClock& clock, const SampleLump& lump) {
    return std::abs(lump.start_s - clock.origin_s -
                    clock.interval_s * static_cast<double>(lump.first_sample));
  };

  // Iteratively re-weighted least squares; convex, and settled to below a nanosecond long before
  // the last round.
  constexpr int kRounds = 50;
  SampleClock clock;
  std::vector<double> weights(lumps.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    double sum_w = 0, mean_n = 0, mean_t = 0;
    for (size_t i = 0; i < lumps.size(); ++i) {
      sum_w += weights[i];
      mean_n += weights[i] * static_cast<double>(lumps[i].first_sample);
      mean_t += weights[i] * lumps[i].start_s;
    }
    mean_n /= sum_w;
    mean_t /= sum_w;
    double nn = 0, nt = 0;
    for (size_t i = 0; i < lumps.size(); ++i) {
      const double n = static_cast<double>(lumps[i].first_sample) - mean_n;
      nn += weights[i] * n * n;
      nt += weights[i] * n * (lumps[i].start_s - mean_t);
    }
    clock.interval_s = nt / nn;
    clock.origin_s = mean_t - clock.interval_s * mean_n;
    if (!(clock.interval_s > 0.0)) return BadInput("payload times do not increase");

    std::vector<double> deviations;
    for (const SampleLump& lump : lumps) deviations.push_back(deviation(clock, lump));
    const double usual = kSigmaOfMedian * MedianOr(deviations, 0.0);
    const double bound = 1.5 * std::max(usual, clock.interval_s);
    for (size_t i = 0; i < lumps.size(); ++i) {
      weights[i] = deviations[i] <= bound ? 1.0 : bound / deviations[i];
    }
  }
  for (size_t i = 0; i < lumps.size(); ++i) {
    if (deviation(clock, lumps[i]) > clock.largest_deviation_s) {
      clock.largest_deviation_s = deviation(clock, lumps[i]);
      clock.largest_deviation_lump = static_cast<int>(i);
    }
  }
  return clock;
}

}  // namespace camgyro
