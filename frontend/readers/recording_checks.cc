#include "frontend/readers/recording_checks.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/constant_axes.h"
#include "core/robust_statistics.h"
#include "core/time.h"
#include "frontend/readers/text.h"
#include "frontend/stamp_clock.h"

namespace camgyro {
namespace {

constexpr double kGyroFullScaleRadS = 2000.0 * M_PI / 180.0;  // of most MEMS gyros, their maximum
// Stamps in microseconds that are read as nanoseconds look like rates of no sensor: a MEMS gyro
// gives at most 32000 samples per second, and of a camera, 10 frames per second look like 10000.
constexpr double kFastestGyroHz = 40e3;
constexpr double kFastestCameraHz = 10e3;

// Two sensors whose samples take turns: neighbours differ by the sensors' biases and axes, samples
// two rows apart by the motion only. Of one sensor, samples farther apart differ more.
bool SamplesTakeTurns(const std::vector<GyroSample>& samples) {
  constexpr size_t kFewest = 100;
  constexpr double kRatio = 3.0;
  if (samples.size() < kFewest) return false;
  const auto median_change = [&](size_t apart) {
    std::vector<double> changes;
    for (size_t i = apart; i < samples.size(); ++i) {
      changes.push_back((samples[i].omega_gyro_rad_s - samples[i - apart].omega_gyro_rad_s).norm());
    }
    return MedianInPlace(&changes);
  };
  return median_change(1) > kRatio * median_change(2);
}

}  // namespace

// Patience sorting, from the end.
std::vector<size_t> LongestNonDecreasing(const std::vector<int64_t>& stamps_ns) {
  if (stamps_ns.empty()) return {};
  std::vector<size_t> heads, after(stamps_ns.size());  // first of the best sequence of each length
  for (size_t i = stamps_ns.size(); i-- > 0;) {
    const auto place =
        std::upper_bound(heads.begin(), heads.end(), stamps_ns[i],
                         [&](int64_t stamp_ns, size_t head) { return stamp_ns > stamps_ns[head]; });
    after[i] = place == heads.begin() ? i : *std::prev(place);
    if (place == heads.end()) {
      heads.push_back(i);
    } else {
      *place = i;
    }
  }
  std::vector<size_t> sequence;
  for (size_t at = heads.back(); sequence.size() < heads.size(); at = after[at]) {
    sequence.push_back(at);
  }
  return sequence;
}

void AddFault(const std::string& name, int count, const std::string& finding,
              Recording* recording) {
  recording->faults.push_back({name, count, finding});
  recording->notes.push_back(finding);
}

void GyroCollector::Add(const GyroSample& sample, const std::optional<Eigen::Vector3d>& accel_m_s2,
                        const std::function<std::string()>& place) {
  std::vector<GyroSample>& gyro = recording_->gyro;
  if (!gyro.empty() && sample.stamp_ns <= gyro.back().stamp_ns) {
    const GyroSample& last = gyro.back();
    const bool equal = sample.stamp_ns == last.stamp_ns;
    if (equal && sample.omega_gyro_rad_s == last.omega_gyro_rad_s &&
        (!accel_m_s2 || *accel_m_s2 == recording_->accel.back().accel_gyro_m_s2)) {
      ++repeated_;
      return;
    }
    std::optional<std::string>& first = equal ? equal_stamps_ : disorder_;
    if (!first) {
      first = Concat(place(), ": timestamp ", sample.stamp_ns,
                     equal ? " repeats with other values, after " : " goes back, after ",
                     last.stamp_ns, "; expected strictly increasing stamps");
    }
  }
  gyro.push_back(sample);
  if (accel_m_s2) recording_->accel.push_back({sample.stamp_ns, *accel_m_s2});
}

void GyroCollector::Keep(const std::vector<size_t>& kept) {
  const bool accel = recording_->accel.size() == recording_->gyro.size();
  for (size_t i = 0; i < kept.size(); ++i) {
    recording_->gyro[i] = recording_->gyro[kept[i]];
    if (accel) recording_->accel[i] = recording_->accel[kept[i]];
  }
  recording_->gyro.resize(kept.size());
  if (accel) recording_->accel.resize(kept.size());
}

int DropRepeatedStamps(Recording* recording) {
  const auto drop = [](auto* samples) {
    const auto equal = [](const auto& a, const auto& b) { return a.stamp_ns == b.stamp_ns; };
    const auto end = std::unique(samples->begin(), samples->end(), equal);
    const auto dropped = samples->end() - end;
    samples->erase(end, samples->end());
    return static_cast<int>(dropped);
  };
  if (!recording->accel.empty()) drop(&recording->accel);
  return drop(&recording->gyro);
}

Status GyroCollector::MendOrder(const std::string& file) {
  std::vector<GyroSample>& gyro = recording_->gyro;
  const size_t all = gyro.size();
  const auto refuse = [&](const std::string& first, size_t lost, const char* likely) {
    return BadInput(
        Concat(first, " (", lost, " of ", all, " samples have such stamps", likely, ")"));
  };
  if (disorder_) {
    const std::vector<size_t> kept = LongestNonDecreasing(StampsOf(gyro));
    const size_t lost = all - kept.size();
    if (TooManyLost(lost, all)) {
      return refuse(*disorder_, lost, ": two streams in one file have to be separated first");
    }
    Keep(kept);
    AddFault("stamps_step_back", static_cast<int>(lost),
             Concat(*disorder_, "; ", lost, " samples that do not fit into the order are left out"),
             recording_);
  }
  if (SamplesTakeTurns(gyro)) {
    return BadInput(Concat(file,
                           ": every other sample is of another sensor: neighbouring rates "
                           "differ far more than those two rows apart; expected the samples "
                           "of one gyro"));
  }
  if (!equal_stamps_) return {};
  if (FindStampClock(StampsOf(gyro)).report.kind == StampKind::kArrival) return {};
  const size_t lost = static_cast<size_t>(DropRepeatedStamps(recording_));
  if (TooManyLost(lost, all)) return refuse(*equal_stamps_, lost, "");
  AddFault(
      "stamps_repeat", static_cast<int>(lost),
      Concat(*equal_stamps_, "; the first sample of each stamp is used, ", lost, " are left out"),
      recording_);
  return {};
}

void MendAccel(const std::string& file, Recording* recording) {
  std::vector<AccelSample>& accel = recording->accel;
  const size_t all = accel.size();
  std::vector<AccelSample> kept;
  for (const size_t i : LongestNonDecreasing(StampsOf(accel))) {
    if (kept.empty() || accel[i].stamp_ns > kept.back().stamp_ns) kept.push_back(accel[i]);
  }
  const size_t lost = all - kept.size();
  if (lost == 0) return;
  const bool useless = TooManyLost(lost, all);
  if (useless) kept.clear();
  accel = std::move(kept);
  AddFault(
      "accel_stamps", static_cast<int>(lost),
      Concat(file, ": ", lost, " of ", all, " accelerations have stamps that repeat or go back; ",
             useless ? "the accelerometer is not used" : "they are left out"),
      recording);
}

Status GyroCollector::Finish(const std::string& file) {
  const std::vector<GyroSample>& gyro = recording_->gyro;
  if (gyro.size() < 2) {
    return BadInput(Concat(file, ": has ", gyro.size(), " samples, expected at least two"));
  }
  if (Status order = MendOrder(file); !order) return order;
  const double interval_s = SecondsSince(gyro.front().stamp_ns, gyro.back().stamp_ns) /
                            static_cast<double>(gyro.size() - 1);
  if (interval_s * kFastestGyroHz < 1.0) {
    return BadInput(Concat(file, ": the mean interval of its stamps is ", interval_s * 1e9,
                           " ns, too short for any gyro; expected stamps in nanoseconds"));
  }
  if (Status unit = CheckRateUnit(file, gyro); !unit) return unit;
  if (const std::string constant = ConstantAxes(gyro); !constant.empty()) {
    recording_->notes.push_back(Concat(file, ": all ", gyro.size(), " rates about ", constant,
                                       " have the same value: an axis that measures nothing?"));
  }
  if (repeated_ > 0) {
    AddFault("samples_repeat", repeated_,
             Concat(file, ": ", repeated_, " rows that repeat the one before were dropped"),
             recording_);
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
