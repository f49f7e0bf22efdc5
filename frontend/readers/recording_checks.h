// What every reader checks in what it found, whatever the format.
#ifndef CAMGYRO_FRONTEND_READERS_RECORDING_CHECKS_H_
#define CAMGYRO_FRONTEND_READERS_RECORDING_CHECKS_H_

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Something was wrong with the data and has been mended: counted, and noted for the user.
void AddFault(const std::string& name, int count, const std::string& finding, Recording* recording);

// Of samples or frames, in their order.
template <typename Stamped>
std::vector<int64_t> StampsOf(const std::vector<Stamped>& items) {
  std::vector<int64_t> stamps_ns;
  stamps_ns.reserve(items.size());
  for (const Stamped& item : items) stamps_ns.push_back(item.stamp_ns);
  return stamps_ns;
}

// Indices of the longest sequence of stamps that does not decrease; of two that exclude each other
// the earlier stays.
std::vector<size_t> LongestNonDecreasing(const std::vector<int64_t>& stamps_ns);

// A repair may cost a twentieth of the samples or frames. Where more are out of order, something
// else is wrong, as two streams in one file.
inline bool TooManyLost(size_t lost, size_t all) { return 20 * lost > all; }

// Collects gyro samples as a reader comes upon them, in the file's order, and decides on those
// whose stamps are out of order.
class GyroCollector {
 public:
  explicit GyroCollector(Recording* recording) : recording_(recording) {}

  // Appends a sample, and the specific force [m/s^2] taken with it, if there is one (in all samples
  // or in none). `place` is asked where this is ("file:line") if the stamp does not increase.
  void Add(const GyroSample& sample, const std::optional<Eigen::Vector3d>& accel_m_s2,
           const std::function<std::string()>& place);

  // Checks the whole: two samples or more, stamps that can be nanoseconds, rates that can be rad/s;
  // `file` is named in messages. Mends the order, and records every repair in the faults:
  //   - rows that repeat the one before exactly are dropped;
  //   - of stamps that step back, those of the longest increasing sequence stay;
  //   - of samples with equal stamps the first stays, unless the stamps are arrival times: then all
  //     stay, and stamps are only non-decreasing until RepairStamps (or DropRepeatedStamps).
  // Error, at the first place, if more than a twentieth of the samples would be lost so, or if the
  // samples of two sensors take turns in the file.
  Status Finish(const std::string& file);

 private:
  void Keep(const std::vector<size_t>& kept);
  Status MendOrder(const std::string& file);

  Recording* recording_;
  int repeated_ = 0;                         // exactly
  std::optional<std::string> disorder_;      // the first stamp that goes back: where and how
  std::optional<std::string> equal_stamps_;  // the first that repeats with other values
};

// Leaves out accelerations of `file` whose stamps repeat or step back, as GyroCollector does, and
// records them in the faults; where too many would be lost, all of them, since the calibration
// needs none.
void MendAccel(const std::string& file, Recording* recording);

// Drops samples whose stamps are not after the one before, the accelerometer's with them if it has
// the gyro's stamps. Returns how many of the gyro.
int DropRepeatedStamps(Recording* recording);

// Error if the 99th percentile of |w| is beyond the full scale of gyros, 2000 deg/s: the rates are
// in deg/s then. Slow motion in deg/s passes; only the camera can tell there.
Status CheckRateUnit(const std::string& file, const std::vector<GyroSample>& gyro);

// Error if there are fewer than two frames, or their stamps cannot be nanoseconds.
Status CheckFrames(const std::string& where, const std::vector<Frame>& frames);

// A note if the stamps of camera and gyro do not overlap: clocks may have different origins, which
// the delay search has to bridge.
void NoteClocks(Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_RECORDING_CHECKS_H_
