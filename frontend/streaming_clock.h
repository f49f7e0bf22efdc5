// The sampling clock behind a gyro's stamps, found while the samples come.
#ifndef CAMGYRO_FRONTEND_STREAMING_CLOCK_H_
#define CAMGYRO_FRONTEND_STREAMING_CLOCK_H_

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Passes samples on, in their order: as they are while their stamps are clean, with the times of
// their sampling clock (FindStampClock over the last 20 s) once they are found to be times of
// arrival. Memory is bounded. The first two seconds are held back until that is known; arrival
// times are held back for some 0.5 s, in which late samples are caught up.
class StreamingClock {
 public:
  // Stamps must not decrease. Appends what can be passed on to *passed; its stamps are strictly
  // increasing.
  void Add(const GyroSample& sample, std::vector<GyroSample>* passed);

  // What was found last; nothing before two seconds of samples.
  const std::optional<StampReport>& report() const { return report_; }

 private:
  void Look();
  void Pass(const GyroSample& sample, std::vector<GyroSample>* passed);

  std::vector<int64_t> recent_ns_;   // recorded stamps
  std::deque<GyroSample> held_;      // the last ones of these
  std::vector<int64_t> sampled_ns_;  // of recent_ns_ when last looked at
  std::optional<StampReport> report_;
  int64_t first_ns_ = 0, looked_ns_ = 0;
  std::optional<int64_t> passed_ns_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_STREAMING_CLOCK_H_
