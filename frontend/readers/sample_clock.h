// A clock for samples that come in lumps: only the start of each lump has a time, and that time
// jumps, while the sensor runs at a constant rate.
#ifndef CAMGYRO_FRONTEND_READERS_SAMPLE_CLOCK_H_
#define CAMGYRO_FRONTEND_READERS_SAMPLE_CLOCK_H_

#include <cstdint>
#include <vector>

#include "core/result.h"

namespace camgyro {

struct SampleLump {
  int64_t first_sample = 0;  // index of its first sample, counted through all lumps
  double start_s = 0.0;      // stamp of that sample, as recorded
};

// t = origin_s + interval_s * sample
struct SampleClock {
  double origin_s = 0.0;
  double interval_s = 0.0;         // > 0
  double largest_deviation_s = 0;  // of a lump's recorded start from the line, absolute
  int largest_deviation_lump = 0;  // where
};

// Fits one straight line through the starts of all lumps, robustly (Huber, at 1.5 robust standard
// deviations, with at least one sampling interval): a lump that starts far off hardly turns the
// line. Errors: fewer than two lumps, first_sample not increasing, a rate that is not positive.
Result<SampleClock> FitSampleClock(const std::vector<SampleLump>& lumps);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_SAMPLE_CLOCK_H_
