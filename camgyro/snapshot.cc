#include "camgyro/snapshot.h"

#include <cstddef>
#include <limits>

#include "camgyro/convert.h"
#include "frontend/stamp_clock.h"

namespace camgyro::api {
namespace {

// The sigmas that make a parameter ready, in the order of the state.
StateVector WantedSigmas(const CalibratorOptions& options, const camgyro::Calibration& c) {
  const double principal_px = options.ready_principal * c.width_px;
  StateVector wanted;
  wanted << options.ready_focal * c.lens[camgyro::kFocal], principal_px, principal_px,
      options.ready_readout_s, options.ready_delay_s,
      Eigen::Vector3d::Constant(options.ready_bias_rad_s),
      Eigen::Vector3d::Constant(options.ready_rotation_rad);
  return wanted;
}

Readiness ReadinessOf(double sigma, double prior_sigma, double error, double wanted,
                      double movement) {
  if (!(sigma < 0.5 * prior_sigma)) return Readiness::kUndetermined;
  if (!(error <= wanted)) return Readiness::kImprecise;
  return movement <= 2.0 * wanted ? Readiness::kReady : Readiness::kUnsteady;
}

void FillEstimate(const OnlineCalibration::Progress& progress, const CalibratorOptions& options,
                  Snapshot* next) {
  const camgyro::Calibration& c = *progress.estimate;
  next->has_estimate = true;
  next->calibration = ToApi(c);
  const StateVector value = ValuesOf(c, c.q_gyro_cam);
  const StateVector wanted = WantedSigmas(options, c);
  const StateVector sigma = c.sigma();
  const StateVector total =
      c.sigma_total().value_or(StateVector::Constant(std::numeric_limits<double>::infinity()));
  next->ready = true;
  for (int i = 0; i < kStateSize; ++i) {
    ParameterState& p = next->parameters[static_cast<std::size_t>(i)];
    p.value = value[i];
    p.sigma = sigma[i];
    p.sigma_total = total[i];
    p.wanted_sigma = wanted[i];
    p.readiness =
        ReadinessOf(sigma[i], progress.prior_sigma[i], total[i], wanted[i], progress.movement[i]);
    next->ready = next->ready && p.readiness == Readiness::kReady;
  }
}

}  // namespace

Snapshot MakeSnapshot(const OnlineCalibration::Progress& progress,
                      const CalibratorOptions& options) {
  Snapshot next;
  next.stage = progress.estimating ? Stage::kEstimating : Stage::kCollecting;
  next.message = progress.message;
  next.frame_stamp_ns = progress.frame_stamp_ns;
  next.clock_skew = progress.clock_skew;
  next.frame_offset_s = progress.frame_offset_s;
  next.frame_offset_sigma_s = progress.frame_offset_sigma_s;
  next.frame_jitter_s = progress.frame_spread_s;
  next.noise_px = progress.noise_px;
  next.frames = progress.frames;
  next.pairs_used = progress.pairs_used;
  next.pairs_skipped = progress.pairs_skipped;
  next.starts = progress.starts;
  next.lens = progress.lens;
  if (progress.frame_stamps) next.frame_stamps = DescribeStamps(*progress.frame_stamps);
  if (progress.estimate) FillEstimate(progress, options, &next);
  return next;
}

bool ReadyButForTotal(const OnlineCalibration::Progress& progress,
                      const CalibratorOptions& options) {
  if (!progress.estimate) return false;
  const StateVector wanted = WantedSigmas(options, *progress.estimate);
  const StateVector sigma = progress.estimate->sigma();
  for (int i = 0; i < kStateSize; ++i) {
    if (ReadinessOf(sigma[i], progress.prior_sigma[i], sigma[i], wanted[i], progress.movement[i]) !=
        Readiness::kReady) {
      return false;
    }
  }
  return true;
}

}  // namespace camgyro::api
