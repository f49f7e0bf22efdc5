#include "estimator/window/fit_quality.h"

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "estimator/window/gyro_noise.h"
#include "estimator/window/residuals/pair_residual.h"
#include "factors/robust.h"

namespace camgyro {

void FitSum::Add(const std::vector<double>& residuals, double factor) {
  for (size_t i = 0; i < residuals.size(); i += static_cast<size_t>(per_match_)) {
    const double length = Eigen::Map<const Eigen::VectorXd>(&residuals[i], per_match_).norm();
    const double bounded = Robustify(length, options_.robust_threshold).value;
    sum_sq_ += factor * factor * bounded * bounded;
    inliers_ += length <= options_.inlier_sigmas() ? 1 : 0;
    ++matches_;
  }
}

double FitSum::rms() const { return std::sqrt(sum_sq_ / std::max(1, per_match_ * matches_)); }

UnseenFit EvaluateUnseen(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                         const Calibration& calibration, double noise_px,
                         const PairGraphOptions& options) {
  UnseenFit fit;
  FitSum sum(options, options.residual->facts().per_match);
  std::vector<std::optional<std::vector<double>>> of_pairs(pairs.size());
  ParallelFor(pairs.size(), [&](size_t i) {
    std::vector<double> residuals;
    if (ResidualOf(pairs[i], options)
            .Unseen(input, pairs[i], calibration, noise_px, options, &residuals)) {
      of_pairs[i] = std::move(residuals);
    }
  });
  double seconds = 0.0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (!of_pairs[i]) continue;
    ++fit.pairs;
    seconds += pairs[i].time_b_s - pairs[i].time_a_s;
    sum.Add(*of_pairs[i], pairs[i].noise_factor);
  }
  if (fit.pairs > 0 && input.rates.size() > 1) {
    const double interval_s = (input.rates.back().time_s - input.rates.front().time_s) /
                              static_cast<double>(input.rates.size() - 1);
    fit.gyro_px =
        calibration.lens[kFocal] *
        std::sqrt(seconds / fit.pairs * TurnVariancePerS(options.gyro_sigma_rad_s, interval_s));
  }
  fit.matches = sum.matches();
  fit.rms_px = noise_px * sum.rms();
  return fit;
}

}  // namespace camgyro
