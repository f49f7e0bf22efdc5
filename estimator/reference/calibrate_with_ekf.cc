#include "estimator/reference/calibrate_with_ekf.h"

#include <chrono>
#include <string>
#include <utility>

#include "estimator/starting_point.h"

namespace camgyro {

EkfRun RunEkf(const EstimationInput& input, const std::vector<Frame>& frames, const Prior& start,
              const EkfOptions& options) {
  using UpdateResult = ImplicitEkf::UpdateResult;
  EkfRun run;
  ImplicitEkf filter(start, options);
  size_t next = 0;
  for (const TimedPair& pair : input.pairs) {
    UpdateResult result = filter.Update(pair.time_a_s, pair.time_b_s, pair.matches);
    while (result == UpdateResult::kGyroTooLate && next < input.rates.size()) {
      filter.AddReading(input.rates[next].time_s, input.rates[next].omega_gyro_rad_s);
      ++next;
      result = filter.Update(pair.time_a_s, pair.time_b_s, pair.matches);
    }
    if (result != UpdateResult::kUpdated) {
      ++run.skipped_pairs;
      continue;
    }
    run.trace.push_back({frames[static_cast<size_t>(pair.frame_b)].stamp_ns, filter.Estimate(),
                         options.sigma_px, /*settled=*/true});
  }
  return run;
}

Result<CalibrationReport> CalibrateWithEkf(const Recording& recording,
                                           const CameraRotationsAt& rotations_at,
                                           const CalibrateOptions& options,
                                           const EkfOptions& ekf_options) {
  if (recording.HasOnlyAttitudes()) {
    return CannotEstimate("the filter needs image motion, and this recording has attitudes only");
  }
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const CameraGuess& declared = recording.camera;
  CalibrationReport report;
  const Result<StartResult> found =
      FindStartAndFocal(recording, rotations_at, options.start, options.focal_scan);
  if (!found) return tl::unexpected(found.error());
  report.start = *found;
  report.times.push_back({"start", elapsed()});

  report.prior = PaperStart(MakePrior(recording, *found).mean);
  Calibration& start = report.prior.mean;
  if (declared.principal_px) start.lens.segment<2>(kCx) = *declared.principal_px;
  if (declared.readout_s) start.readout_s = *declared.readout_s;
  if (declared.delay_s) start.delay_s = *declared.delay_s;
  start.q_gyro_cam = declared.q_gyro_cam.value_or(Eigen::Quaterniond(found->nearest_permutation));
  EkfRun run = RunEkf(MakeEstimationInput(recording), recording.frames, report.prior, ekf_options);
  if (run.trace.empty()) {
    return CannotEstimate(
        "no pair of frames could be used: they need three matches and gyro "
        "samples around them");
  }
  report.times.push_back({"window", elapsed() - report.times.back().seconds});
  report.calibration = run.trace.back().estimate;
  for (size_t i = 0; i < kStateSize; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    report.calibration.determined[i] =
        report.calibration.sigma()[row] < 0.5 * report.prior.sigma[row];
  }
  report.online = report.calibration;
  report.trace = std::move(run.trace);
  report.pairs_used_online = static_cast<int>(report.trace.size());
  report.skipped_pairs = run.skipped_pairs;
  report.quality.pairs = report.pairs_used_online;
  report.quality.noise_px = ekf_options.sigma_px;
  report.converged = true;
  report.notes.push_back(
      "the filter of Jia & Evans as published, for comparison: its sigmas are over-confident");
  Calibration with_effects = start;
  const Status added = AddStartEffects(recording, *found, "", ByPlane(), &with_effects);
  if (added && with_effects.effects) {
    std::string names;
    for (const EffectSet::Item& item : with_effects.effects->items()) {
      names += (names.empty() ? "" : ", ") + item.entry->name;
    }
    report.notes.push_back("the filter does not know " + names +
                           ", which the start has found in this recording, or cannot rule out: its "
                           "estimate may be off by that");
  }
  return report;
}

}  // namespace camgyro
