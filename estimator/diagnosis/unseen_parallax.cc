#include "estimator/diagnosis/unseen_parallax.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "estimator/window/smooth_motion.h"

namespace camgyro {
namespace {

// Of the noise of a displacement, and the longest gap that it is for (docs/lab/pairs.md).
constexpr double kHiddenShift = 1.4;
constexpr double kUsualGapS = 0.2;

// Turn that a pair hides [rad/s]; negative where it says nothing.
double HiddenBy(const TimedPair& pair, const Calibration& calibration, double variance_px2) {
  const double unsmooth_px2 =
      UnsmoothVariance(pair.matches, Eigen::Vector2d(calibration.width_px, calibration.height_px));
  if (unsmooth_px2 < 0.0) return -1.0;
  const double gap_s = pair.time_b_s - pair.time_a_s;
  const double parallax_sq = std::max(0.0, unsmooth_px2 / variance_px2 - 2.0);
  const double gap_of_sigma_s = std::max(std::min(gap_s, kUsualGapS), gap_s * parallax_sq);
  return kHiddenShift * std::sqrt(variance_px2) / calibration.lens[kFocal] / gap_of_sigma_s;
}

}  // namespace

double UnseenParallax(const std::vector<TimedPair>& pairs, const Calibration& calibration,
                      double noise_px, const PairGraphOptions& options) {
  std::vector<double> hidden(pairs.size(), -1.0);
  ParallelFor(pairs.size(), [&](size_t k) {
    const TimedPair& pair = pairs[k];
    if (!ResidualOf(pair, options).facts().has_direction) return;
    // Of one coordinate of a displacement.
    const double variance_px2 = std::pow(noise_px * pair.noise_factor, 2) *
                                (options.match_noise == MatchNoise::kBothImages ? 2.0 : 1.0);
    hidden[k] = HiddenBy(pair, calibration, variance_px2);
  });
  hidden.erase(std::remove(hidden.begin(), hidden.end(), -1.0), hidden.end());
  return MedianOr(std::move(hidden), 0.0);
}

}  // namespace camgyro
