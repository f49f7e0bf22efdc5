// Time: int64 nanoseconds at every boundary; double seconds relative to a named origin inside.
#ifndef CAMGYRO_CORE_TIME_H_
#define CAMGYRO_CORE_TIME_H_

#include <cmath>
#include <cstdint>

namespace camgyro {

// Stamp of a clock [ns] as seconds after `origin_ns` of the same clock. Exact to 1 ns for
// differences below 104 days: the difference is taken in integers.
inline double SecondsSince(int64_t origin_ns, int64_t stamp_ns) {
  return 1e-9 * static_cast<double>(stamp_ns - origin_ns);
}

// Inverse of SecondsSince, rounded to the nearest nanosecond.
inline int64_t StampAt(int64_t origin_ns, double seconds) {
  return origin_ns + static_cast<int64_t>(std::llround(seconds * 1e9));
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_TIME_H_
