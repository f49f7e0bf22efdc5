#include "estimator/window/fit_quality.h"

#include <Eigen/Core>
#include <algorithm>
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
  OfPair& pair = pairs_.emplace_back();
  for (size_t i = 0; i < residuals.size(); i += static_cast<size_t>(per_match_)) {
    const double length = Eigen::Map<const Eigen::VectorXd>(&residuals[i], per_match_).norm();
    const double bounded = Robustify(length, options_.robust_threshold).value;
    pair.sum_sq += factor * factor * bounded * bounded;
    inliers_ += length <= options_.inlier_sigmas() ? 1 : 0;
    ++pair.matches;
  }
  matches_ += pair.matches;
}

double FitSum::RmsOf(const std::vector<OfPair>& pairs, int lost_per_pair) const {
  double sum_sq = 0.0;
  int freedom = 0;
  for (const OfPair& pair : pairs) {
    sum_sq += pair.sum_sq;
    freedom += std::max(0, per_match_ * pair.matches - lost_per_pair);
  }
  return std::sqrt(sum_sq / std::max(1, freedom));
}

double FitSum::rms() const { return RmsOf(pairs_, 0); }

double FitSum::usual_rms() const {
  constexpr double kWorst = 0.1;
  std::vector<OfPair> usual = pairs_;
  std::sort(usual.begin(), usual.end(), [](const OfPair& a, const OfPair& b) {
    return a.sum_sq * b.matches < b.sum_sq * a.matches;
  });
  usual.resize(usual.size() - static_cast<size_t>(kWorst * static_cast<double>(usual.size())));
  return RmsOf(usual, lost_per_pair_);
}

UnseenFit EvaluateUnseen(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                         const Calibration& calibration, double noise_px,
                         const PairGraphOptions& options) {
  UnseenFit fit;
  FitSum sum(options, options.residual->facts().per_match, /*lost_per_pair=*/0);
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
  fit.usual_rms_px = noise_px * sum.usual_rms();
  return fit;
}

}  // namespace camgyro
