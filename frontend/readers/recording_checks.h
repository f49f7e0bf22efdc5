// What every reader checks in what it found, whatever the format.
#ifndef CAMGYRO_FRONTEND_READERS_RECORDING_CHECKS_H_
#define CAMGYRO_FRONTEND_READERS_RECORDING_CHECKS_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Collects gyro samples as a reader comes upon them.
class GyroCollector {
 public:
  explicit GyroCollector(Recording* recording) : recording_(recording) {}

  // Appends a sample, and the specific force [m/s^2] taken with it, if there is one (in all samples
  // or in none). One that repeats the one before exactly is dropped. Returns what is wrong if its
  // stamp does not increase; the caller knows the place.
  [[nodiscard]] std::optional<std::string> Add(const GyroSample& sample,
                                               const std::optional<Eigen::Vector3d>& accel_m_s2);

  // Checks the whole: two samples or more, stamps that can be nanoseconds, rates that can be rad/s.
  // Notes what was dropped. `file` is named in messages.
  Status Finish(const std::string& file);

 private:
  Recording* recording_;
  int repeated_ = 0;
};

// Error if the 99th percentile of |w| is beyond the full scale of gyros, 2000 deg/s: the rates are
// in deg/s then. Slow motion in deg/s passes; only the camera can tell there.
Status CheckRateUnit(const std::string& file, const std::vector<GyroSample>& gyro);

// What is wrong with a stamp that does not come after `last_ns`; nothing if it does.
std::optional<std::string> NotIncreasing(int64_t last_ns, int64_t stamp_ns);

// Error if there are fewer than two frames, or their stamps cannot be nanoseconds.
Status CheckFrames(const std::string& where, const std::vector<Frame>& frames);

// A note if the stamps of camera and gyro do not overlap: clocks may have different origins, which
// the delay search has to bridge.
void NoteClocks(Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_RECORDING_CHECKS_H_
