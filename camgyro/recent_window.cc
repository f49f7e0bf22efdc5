#include "camgyro/recent_window.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/pair_model.h"

namespace camgyro::api {
namespace {

constexpr std::size_t kMaxRecentFrames = 2000;

}  // namespace

void RecentWindow::Add(const std::vector<GyroSample>& samples) {
  if (samples.empty()) return;
  gyro_.insert(gyro_.end(), samples.begin(), samples.end());
  Trim(&gyro_, kRecentSamplesS, kMaxRecentSamples);
}

void RecentWindow::Add(const AccelSample& sample) {
  accel_.push_back(sample);
  Trim(&accel_, kRecentSamplesS, kMaxRecentSamples);
}

void RecentWindow::Add(OnlineFrame frame) {
  frames_.push_back(std::move(frame));
  Trim(&frames_, kRecentFramesS, kMaxRecentFrames);
}

void RecentWindow::CopyTo(double window_s, VinsInput* input) const {
  if (frames_.empty() || gyro_.empty()) return;
  const double delay_s = input->calibration.delay_s;
  const double margin_s =
      0.05 + std::abs(input->calibration.readout_s) + std::abs(ColumnReadoutOf(input->calibration));
  const std::int64_t newest_ns = StampAt(gyro_.back().stamp_ns, -delay_s - margin_s);
  const auto last = std::upper_bound(
      frames_.begin(), frames_.end(), newest_ns,
      [](std::int64_t stamp_ns, const OnlineFrame& f) { return stamp_ns < f.stamp_ns; });
  if (last == frames_.begin()) return;
  const std::int64_t first_ns = StampAt((last - 1)->stamp_ns, -window_s);
  for (auto frame = frames_.begin(); frame != last; ++frame) {
    if (frame->stamp_ns < first_ns) continue;
    input->frame_stamps_ns.push_back(frame->stamp_ns);
    input->tracks.push_back(frame->points);
  }
  const std::int64_t from_ns = StampAt(first_ns, delay_s - margin_s);
  for (const GyroSample& sample : gyro_) {
    if (sample.stamp_ns >= from_ns) input->gyro.push_back(sample);
  }
  for (const AccelSample& sample : accel_) {
    if (sample.stamp_ns >= from_ns) input->accel.push_back(sample);
  }
}

}  // namespace camgyro::api
