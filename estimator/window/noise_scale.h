// The noise of the pairs, from what a fit leaves.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_NOISE_SCALE_H_
#define CAMGYRO_ESTIMATOR_WINDOW_NOISE_SCALE_H_

#include <Eigen/Core>
#include <vector>

#include "core/recording.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/residuals/pair_residual.h"

namespace camgyro {

// The noise of the pairs [px, rad of attitudes] from residuals of which the rates, fitted as well,
// have taken a part.
class NoiseScale {
 public:
  // Attitudes that follow the gyro itself agree with it far better than its noise: less than this
  // share of it is never believed of them. It makes the variance of a turn 11 % larger. Smaller
  // scales say no more, and the factorisation of the information fails.
  static constexpr double kLeastShareOfGyro = 1.0 / 3.0;
  // Exact pixels, of simulations: no tracker comes near [px].
  static constexpr double kLeastPx = 1e-3;

  // gyro_sigma_rad_s: of a gyro sample.
  NoiseScale(const PairResidual::Facts& residual, const EstimationInput& input,
             const std::vector<TimedPair>& pairs, const Eigen::Vector3d& gyro_sigma_rad_s);
  // Of matches.
  explicit NoiseScale(const PairResidual::Facts& residual);

  // residuals: of each pair, in sigmas of `scale`, after a solve. Attitudes keep the share s^2 /
  // (s^2 + g) of a misfit with the variance s^2 + g, s being the scale and g the gyro's variance of
  // a turn.
  double Next(const std::vector<std::vector<double>>& residuals, double scale) const;
  // How noisy each pair is in units of the scale, geometric mean 1. Pictures are blurred and dark
  // for a while: the noise of a hand-held phone's pairs scatters by 44 %, that of a drone's global
  // shutter by 5 % (docs/lab/measured.md). A pair's own scale is known only so well; what it has
  // beyond that scatters over the recording by a variance that all pairs tell together, and each is
  // taken as far as that makes it likely (empirical Bayes): all factors are 1 where pairs differ by
  // chance only, and those of pairs with fewer than four. differences: NeighbourDifferences of each
  // pair, in sigmas of scale and `now`.
  std::vector<double> FactorsOfPairs(const std::vector<std::vector<double>>& differences,
                                     const std::vector<double>& now) const;
  // By what factor the scale of matches changes.
  double Growth(const std::vector<std::vector<double>>& residuals, double scale) const;

 private:
  int lost_;  // degrees of freedom of a pair that are its own
  double least_ = kLeastPx;
  double gyro_variance_ = 0.0;  // of a turn between attitudes, per axis [rad^2]; 0 with pixels
};

// Differences of the residuals of matches that are neighbours in the first picture, each match in
// one of them, over sqrt(2): their noise. What a model lacks is smooth over the picture and
// cancels for the most part, so that pairs do not hide it behind a noise of their own; of a strong
// lens that nothing declares enough is left to make simulated noise scatter by 27 to 40 %
// (docs/lab/measured.md, ov_handheld_*).
// As many residuals as matches (CHECKed), or none.
std::vector<double> NeighbourDifferences(const std::vector<Match>& matches,
                                         const std::vector<double>& residuals);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_NOISE_SCALE_H_
