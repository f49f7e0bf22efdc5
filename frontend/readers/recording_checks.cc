#include "frontend/readers/recording_checks.h"

#include <algorithm>
#include <cmath>

#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr double kGyroFullScaleRadS = 2000.0 * M_PI / 180.0;  // of most MEMS gyros, their maximum
constexpr double kFastestGyroHz = 100e3;
constexpr double kFastestCameraHz = 100e3;

}  // namespace

std::optional<std::string> GyroCollector::Add(const GyroSample& sample,
                                              const std::optional<Eigen::Vector3d>& accel_m_s2) {
  std::vector<GyroSample>& gyro = recording_->gyro;
  if (!gyro.empty()) {
    const GyroSample& last = gyro.back();
    if (sample.stamp_ns == last.stamp_ns && sample.omega_gyro_rad_s == last.omega_gyro_rad_s &&
        (!accel_m_s2 || *accel_m_s2 == recording_->accel.back().accel_gyro_m_s2)) {
      ++repeated_;
      return std::nullopt;
    }
    if (const auto wrong = NotIncreasing(last.stamp_ns, sample.stamp_ns)) return wrong;
  }
  gyro.push_back(sample);
  if (accel_m_s2) recording_->accel.push_back({sample.stamp_ns, *accel_m_s2});
  return std::nullopt;
}

Status GyroCollector::Finish(const std::string& file) {
  const std::vector<GyroSample>& gyro = recording_->gyro;
  if (gyro.size() < 2) {
    return BadInput(Concat(file, ": has ", gyro.size(), " samples, expected at least two"));
  }
  if (MedianInterval(gyro) * kFastestGyroHz < 1.0) {
    return BadInput(Concat(file, ": the median interval of its stamps is ",
                           MedianInterval(gyro) * 1e9,
                           " ns, too short for any gyro; expected stamps in nanoseconds"));
  }
  if (Status unit = CheckRateUnit(file, gyro); !unit) return unit;
  if (repeated_ > 0) {
    recording_->notes.push_back(
        Concat(file, ": ", repeated_, " rows that repeat the one before were dropped"));
  }
  return {};
}

Status CheckRateUnit(const std::string& file, const std::vector<GyroSample>& gyro) {
  std::vector<double> rates;
  rates.reserve(gyro.size());
  for (const GyroSample& sample : gyro) rates.push_back(sample.omega_gyro_rad_s.norm());
  const auto high = rates.begin() + static_cast<std::ptrdiff_t>(0.99 * (rates.size() - 1));
  std::nth_element(rates.begin(), high, rates.end());
  if (*high <= kGyroFullScaleRadS) return {};
  return BadInput(Concat(file, ": angular rates reach ", *high,
                         ", and in rad/s most gyros end at 35: looks like deg/s; the columns must "
                         "be rad/s; put [deg s^-1] in the header to have them converted"));
}

std::optional<std::string> NotIncreasing(int64_t last_ns, int64_t stamp_ns) {
  if (stamp_ns > last_ns) return std::nullopt;
  return Concat("timestamp ", stamp_ns,
                stamp_ns == last_ns ? " repeats with other values, after " : " goes back, after ",
                last_ns, "; expected strictly increasing stamps");
}

Status CheckFrames(const std::string& where, const std::vector<Frame>& frames) {
  if (frames.size() < 2) {
    return BadInput(Concat(where, ": has ", frames.size(), " frames, expected at least two"));
  }
  if (MedianInterval(frames) * kFastestCameraHz < 1.0) {
    return BadInput(Concat(where, ": the median interval of frame stamps is ",
                           MedianInterval(frames) * 1e9,
                           " ns, too short for any camera; expected stamps in nanoseconds"));
  }
  return {};
}

void NoteClocks(Recording* recording) {
  const int64_t cam_first = recording->frames.front().stamp_ns;
  const int64_t cam_last = recording->frames.back().stamp_ns;
  const int64_t gyro_first = recording->gyro.front().stamp_ns;
  const int64_t gyro_last = recording->gyro.back().stamp_ns;
  if (cam_first <= gyro_last && gyro_first <= cam_last) return;
  recording->notes.push_back(Concat("camera and gyro clocks do not overlap: frames from ",
                                    cam_first, " to ", cam_last, " ns, gyro from ", gyro_first,
                                    " to ", gyro_last, " ns"));
}

}  // namespace camgyro
