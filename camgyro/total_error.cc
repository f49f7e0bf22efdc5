#include "camgyro/total_error.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/time.h"
#include "estimator/calibrate.h"
#include "estimator/diagnosis/model_check.h"
#include "estimator/starting_point.h"
#include "estimator/window/estimation_input.h"

namespace camgyro::api {
namespace {

using camgyro::EffectSet;

constexpr char kClocks[] = "clock_skew";

// The effects of the estimate that are of the device, as its lens; those of clocks are of a
// recording.
std::vector<EffectSet::Item> OfDevice(const camgyro::Calibration& estimate) {
  std::vector<EffectSet::Item> of_device;
  if (estimate.effects == nullptr) return of_device;
  for (const EffectSet::Item& item : estimate.effects->items()) {
    if (item.entry->name != kClocks && !item.effect->frees_frame_times()) of_device.push_back(item);
  }
  return of_device;
}

std::string NamesOf(const camgyro::Calibration& estimate) {
  std::string names = kClocks;
  for (const EffectSet::Item& item : OfDevice(estimate)) {
    names += "," + item.entry->name + ":" + item.shape;
  }
  return names;
}

void TakeDevice(const camgyro::Calibration& estimate, camgyro::Calibration* calibration) {
  for (const EffectSet::Item& from : OfDevice(estimate)) {
    for (const EffectSet::Item& to : calibration->effects->items()) {
      if (to.entry != from.entry) continue;
      calibration->effect_values.segment(to.first, to.effect->size()) =
          estimate.effect_values.segment(from.first, from.effect->size());
    }
  }
}

}  // namespace

bool TotalError::Due(std::int64_t frame_stamp_ns) const {
  return !checked_ns_ || SecondsSince(*checked_ns_, frame_stamp_ns) >= kBetweenChecksS;
}

void TotalError::Renew(const VinsInput& latest, MatchNoise noise,
                       const OnlineCalibration::Progress& progress) {
  checked_ns_ = progress.frame_stamp_ns;
  Recording recording;
  recording.camera = camera_;
  recording.match_noise = noise;
  for (const std::int64_t stamp_ns : latest.frame_stamps_ns) {
    recording.frames.emplace_back().stamp_ns = stamp_ns;
  }
  recording.tracks = latest.tracks;
  recording.gyro = latest.gyro;
  recording.accel = latest.accel;
  if (recording.frames.size() < 2 || recording.gyro.size() < 2) return;

  // The clocks' rates are in the model, and the frames' own times. Here the delay is that of the
  // first sample.
  recording.camera_stamps = progress.frame_stamps;
  CalibrationReport report;
  camgyro::Calibration& calibration = report.calibration;
  calibration = *progress.estimate;
  calibration.effects = nullptr;
  report.start.clock_skew = progress.clock_skew;
  const Status added = AddStartEffects(recording, report.start, NamesOf(*progress.estimate),
                                       ByPlane(), &calibration);
  if (!added) return;
  TakeDevice(*progress.estimate, &calibration);
  const FrameTime latest_frame{
      SecondsSince(recording.gyro.front().stamp_ns, progress.frame_stamp_ns),
      std::numeric_limits<double>::quiet_NaN()};
  calibration.delay_s += progress.estimate->delay_s - FirstDelayOf(calibration, latest_frame);
  if (const int spread = calibration.effects->frame_time_spread(); spread >= 0) {
    calibration.effect_values[spread] = progress.frame_spread_s;
  }
  calibration.effect_covariance =
      Eigen::MatrixXd::Zero(calibration.effect_values.size(), calibration.effect_values.size());
  report.prior = {calibration, progress.prior_sigma};
  report.start.delay_middle_row_s = report.calibration.delay_s + 0.5 * report.calibration.readout_s;
  report.quality.noise_px = progress.noise_px;
  doubt_ = CheckModel(recording, {}, device_, &report, FittedTo::kMoreData).value_or("");
  const auto& total = report.calibration.total_covariance;
  if (total && total->allFinite()) added_ = *total - report.calibration.covariance;
}

void TotalError::Forget() {
  checked_ns_.reset();
  added_.reset();
  doubt_.clear();
}

void TotalError::AddTo(OnlineCalibration::Progress* progress) const {
  if (!progress->estimate || !added_) return;
  progress->estimate->total_covariance = StateCovariance(progress->estimate->covariance + *added_);
}

}  // namespace camgyro::api
