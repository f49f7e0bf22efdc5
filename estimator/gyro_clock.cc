#include "estimator/gyro_clock.h"

#include <algorithm>
#include <cmath>

#include "core/format.h"
#include "core/stamp_rate.h"

namespace camgyro {
namespace {

// Of the clock at the ends of the recording [s]: less turns no camera by a visible angle.
// frontend/stamp_clock.cc has the same bound for the scatter of stamps.
constexpr double kVisibleS = 50e-6;

}  // namespace

std::string ShapeOfGyroClock(const Recording& recording) {
  const double rate = GyroRateSigma(recording);
  const bool shows = 0.5 * GyroSpanS(recording) * rate > kVisibleS;
  return shows ? Format("%.0f", std::ceil(1e6 * rate)) : "";
}

void AddGyroClock(const Recording& recording, Calibration* calibration) {
  if (!recording.gyro_stamps || !recording.gyro_stamps->repaired) return;
  Calibration& c = *calibration;
  const double rate = GyroRateSigma(recording);
  c.covariance(kStateDelay, kStateDelay) += std::pow(recording.gyro_stamps->level_sigma_s, 2);
  c.covariance(kStateFocal, kStateFocal) += std::pow(c.lens[kFocal] * rate, 2);
  if (c.effects == nullptr) return;
  // With the other shapes the delay is that in the middle of the stamps, where their clock does not
  // depend on its rate.
  const auto& items = c.effects->items();
  if (std::any_of(items.begin(), items.end(), [](const EffectSet::Item& item) {
        return item.entry->name == "clock_skew" && item.shape == "constant";
      })) {
    c.covariance(kStateDelay, kStateDelay) += std::pow(0.5 * rate * GyroSpanS(recording), 2);
  }
}

}  // namespace camgyro
