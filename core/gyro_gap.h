// What counts as a hole in the gyro's samples: between its two ends nobody knows how the camera
// turned, and pairs of frames that need it are left out.
#ifndef CAMGYRO_CORE_GYRO_GAP_H_
#define CAMGYRO_CORE_GYRO_GAP_H_

#include <algorithm>

namespace camgyro {

// Five intervals are four samples lost in a row: interpolating across them is as good as a gyro of
// a fifth of the rate. No step up to 30 ms is a hole, however fast the gyro: a hand's motion has
// little above 10 Hz, and loggers that stamp on arrival deliver in lumps of 20 ms.
constexpr double kGyroGapIntervals = 5.0;
constexpr double kGyroGapFloorS = 0.03;

// The longest step between two samples that is no hole [s]. usual_interval_s: the median.
inline double LongestGyroStep(double usual_interval_s) {
  return std::max(kGyroGapFloorS, kGyroGapIntervals * usual_interval_s);
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_GYRO_GAP_H_
