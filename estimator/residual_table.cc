#include "estimator/residual_table.h"

#include <optional>

#include "estimator/window/pair_view.h"

namespace camgyro {

std::vector<MatchResidual> ComputeResiduals(const EstimationInput& input,
                                            const std::vector<TimedPair>& pairs,
                                            const Calibration& calibration, double noise_px,
                                            const PairGraphOptions& options) {
  std::vector<MatchResidual> residuals;
  const ShutterParameters shutter = ShutterOf(calibration);
  PairView view;
  std::vector<MatchMisfit> misfits;
  for (const TimedPair& pair : pairs) {
    if (!ResidualOf(pair, options)
             .Explain(input, pair, calibration, noise_px, options, std::nullopt, &view, &misfits)) {
      continue;
    }
    for (size_t i = 0; i < misfits.size(); ++i) {
      MatchResidual row;
      static_cast<MatchMisfit&>(row) = misfits[i];
      row.frame_a = pair.frame_a;
      row.frame_b = pair.frame_b;
      row.match = view.measurement.matches[i];
      row.time_s = RowTimeGyroS(pair.time_b_s, shutter, row.match.px_b.y(), calibration.height_px);
      row.rate_rad_s = view.bearings.b[i].omega_cam_rad_s.norm();
      residuals.push_back(row);
    }
  }
  return residuals;
}

}  // namespace camgyro
