// How well the rate of a clock is known that was laid behind a gyro's stamps of arrival.
#ifndef CAMGYRO_CORE_STAMP_RATE_H_
#define CAMGYRO_CORE_STAMP_RATE_H_

#include <cmath>

#include "core/recording.h"
#include "core/time.h"

namespace camgyro {

// The clock is a line through the earliest stamps of stretches of that length
// (frontend/stamp_clock.h).
constexpr double kStampStretchS = 0.25;

// Standard deviation of the rate of a clock behind stamps that cover span_s [s/s]. Stretches are
// off the line by residual_s each (StampReport), independently, and the line is one with a fifth of
// them below: with Gaussian scatter it is known 1.43 times worse than that of least squares, whose
// slope has the variance 12 residual_s^2 / (n span_s^2).
inline double StampRateSigma(double residual_s, double span_s) {
  constexpr double kOfQuantileLine = 1.43;
  if (!(span_s > 0.0)) return 0.0;
  return kOfQuantileLine * residual_s * std::sqrt(12.0 * kStampStretchS / span_s) / span_s;
}

// From the first to the last gyro stamp.
inline double GyroSpanS(const Recording& recording) {
  const auto& gyro = recording.gyro;
  return gyro.empty() ? 0.0 : SecondsSince(gyro.front().stamp_ns, gyro.back().stamp_ns);
}

// Of the gyro's clock [s/s]; 0: it has its stamps as recorded.
inline double GyroRateSigma(const Recording& recording) {
  const auto& stamps = recording.gyro_stamps;
  return stamps && stamps->repaired ? StampRateSigma(stamps->residual_s, GyroSpanS(recording))
                                    : 0.0;
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_STAMP_RATE_H_
