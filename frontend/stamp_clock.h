// The sampling clock behind a stream's stamps.
//
// A sensor samples by a clock of its own: a period, slow drift, now and then a missing sample.
// Stamps are readings of that clock, or the times at which samples arrived in a program: later by
// a latency that is positive, heavy-tailed, shared by the samples of a bunch or packet, sometimes
// rounded to milliseconds. The clock's rate is then that of the lower envelope of the stamps over
// the samples' numbers (as for one-way delays in networks: Zhang, Liu, Xia, "Clock synchronization
// algorithms for network measurements", INFOCOM 2002). Its offset is such that the median stamp is
// on time: the least latency of a stream is a matter of a few of its stamps, the usual one is not.
#ifndef CAMGYRO_FRONTEND_STAMP_CLOCK_H_
#define CAMGYRO_FRONTEND_STAMP_CLOCK_H_

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/recording.h"

namespace camgyro {

struct StampClock {
  StampReport report;
  std::vector<int64_t> sampled_ns;  // times of the samples by the clock, strictly increasing;
                                    // empty where stamps are to be left as they are
};

// Finds the clock. `stamps_ns`: in the order of the samples, not decreasing (several may be equal).
// Fewer than 40 stamps are kMeasured.
//
//   - samples are numbered: where nearly all intervals are multiples of a period, by these; else a
//     number is skipped where the lower envelope of the stamps rises for good by a period (late
//     samples are caught up, missing ones are not);
//   - stamps are kArrival only where the evidence is clear: neighbouring intervals scatter by more
//     than 1 % of the period (and 0.05 ms), or samples come late by more than half a period (or 5
//     ms) and are caught up;
//   - the clock is made of straight lines over 20 s each (oscillators of phones drift by up to
//     5e-6 per second: 0.2 ms off such a line), or longer ones where latencies are so large that
//     stamps tell such lines worse than that, through the earliest fifth of stretches of 0.25 s,
//     faded into each other; it starts anew after gaps of more than 0.25 s.
//
// Clean stamps, also those with drift, steps and gaps, are kMeasured: leave them as they are.
// With `even_if_clean`, sampled_ns is filled for clean stamps too, if there are enough.
StampClock FindStampClock(const std::vector<int64_t>& stamps_ns, bool even_if_clean = false);

// How badly each sample's rate is foretold by linear interpolation between its neighbours: median
// squared error [rad^2/s^2] with these stamps. The better stamps foretell better.
double InterpolationError(const std::vector<GyroSample>& samples,
                          const std::vector<int64_t>& stamps_ns);

// "arrival times: up to 31 ms late; clock of 5.00758 ms, residual 0.3 ms"
std::string DescribeStamps(const StampReport& report);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_STAMP_CLOCK_H_
