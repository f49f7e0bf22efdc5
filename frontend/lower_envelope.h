// The lower envelope of stamps that come late: the few that came soon tell of a clock's samples
// what all the others hide.
#ifndef CAMGYRO_FRONTEND_LOWER_ENVELOPE_H_
#define CAMGYRO_FRONTEND_LOWER_ENVELOPE_H_

#include <cstddef>
#include <vector>

namespace camgyro {

// Late samples have been caught up after that long, but for few [s].
constexpr double kLookaheadS = 0.25;
constexpr size_t kFewestAhead = 16;  // samples

// Samples of a stream in some time, not fewer than `least`.
size_t SamplesIn(double seconds, double period_s, size_t least);

// The value that a share q of some values is below. At least one value.
double Quantile(std::vector<double> values, double q);

// Minimum of values[i .. i + ahead], for every i; and of values[i - behind .. i].
std::vector<double> ForwardMinimum(const std::vector<double>& values, size_t ahead);
std::vector<double> BackwardMinimum(std::vector<double> values, size_t behind);

struct Envelope {
  size_t ahead = 0;           // samples
  std::vector<double> least;  // of each sample's lateness and that of those ahead [s]
  // A missing sample lifts all that follows by a period, for good. Where the envelope rises by more
  // than this from one stretch to the next, it is no chance [s].
  double rise = 0.0;
};

// Looks ahead over kLookaheadS, or over up to 2 s where that is too short to tell a missing sample
// from chance. late: stamps less their clock, which may run at a slightly wrong rate [s].
Envelope EnvelopeToCome(const std::vector<double>& late, double period_s);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_LOWER_ENVELOPE_H_
