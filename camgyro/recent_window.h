// The latest samples and frames of a calibrator, as far back as InitialiseVins may look.
#ifndef CAMGYRO_RECENT_WINDOW_H_
#define CAMGYRO_RECENT_WINDOW_H_

#include <cstddef>
#include <deque>
#include <vector>

#include "camgyro/online_calibration.h"
#include "core/recording.h"
#include "core/time.h"
#include "estimator/vins/initialise.h"

namespace camgyro::api {

// Drops what lies more than keep_s before the newest, and what is more than `keep` in number.
template <typename Stamped>
void Trim(std::deque<Stamped>* items, double keep_s, std::size_t keep) {
  while (items->size() > keep ||
         SecondsSince(items->front().stamp_ns, items->back().stamp_ns) > keep_s) {
    items->pop_front();
  }
}

constexpr double kRecentFramesS = 12.0;
constexpr double kRecentSamplesS = 20.0;
constexpr std::size_t kMaxRecentSamples = 50'000;

// Not thread-safe. Stamps of each stream increase.
class RecentWindow {
 public:
  void Add(const std::vector<GyroSample>& samples);
  void Add(const AccelSample& sample);
  void Add(OnlineFrame frame);

  // The frames of the latest window_s that the gyro covers, by the delay and readout of
  // input->calibration, and the samples around them. Adds none where there are none.
  void CopyTo(double window_s, VinsInput* input) const;

 private:
  std::deque<GyroSample> gyro_;
  std::deque<AccelSample> accel_;
  std::deque<OnlineFrame> frames_;
};

}  // namespace camgyro::api

#endif  // CAMGYRO_RECENT_WINDOW_H_
