// What a fit of pairs of frames assumes: what they are held against, noise, loss, rates.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_OPTIONS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_OPTIONS_H_

#include <Eigen/Core>
#include <optional>

#include "core/recording.h"
#include "estimator/window/residuals/all_residuals.h"

namespace camgyro {

struct PairGraphOptions {
  const PairResidual* residual = &ByPlane();  // of matches; attitudes have their own (ResidualOf)
  MatchNoise match_noise = MatchNoise::kBothImages;
  // Noise of the pairs added from now on, per axis [px; rad of attitudes], but for each pair's own
  // factor; none: the residual's first guess.
  std::optional<double> sigma;
  double first_sigma() const { return sigma.value_or(residual->facts().usual_sigma); }
  double robust_threshold = 2.5;  // in sigmas; 0: none
  // Within so many sigmas a match counts as an inlier, also without loss.
  double inlier_sigmas() const { return robust_threshold > 0.0 ? robust_threshold : 2.5; }
  // Prior of the bend of the path: how fast the direction of motion changes [rad/s]. Steps turn it
  // in phase with the rotation, so that what the prior takes from a turn becomes a bias of t_r, t_d
  // and b_g; much wider than the turns are, directions follow the noise, which biases, too.
  double turn_sigma_rad_s = 8.0;
  // Matches without a ray through the lens as the effects make it at the start are left out, for
  // good; else such a start has no solution. (Without effects, they always are.)
  bool drop_without_ray = false;
  // Lens, shutter, mounting, effects, biases and rates are known: solves move what pairs and frames
  // have of their own.
  bool hold_shared = false;
  // Each pair keeps its linearisation while its residuals change by less than this, root mean
  // square (KeptCost): for few pairs that are solved again and again. 0: while nothing changes.
  // Negative: not at all. A refinement chooses by itself.
  double keep_within_sigmas = -1.0;
  // White noise of one gyro sample per axis (Jia & Evans section V.C); see GyroSigma.
  Eigen::Vector3d gyro_sigma_rad_s = Eigen::Vector3d::Constant(0.003);
  double bias_walk_rad_s2_rtHz = 1e-4;
  double bias_interval_s = 1.0;  // one bias block for each interval
  // Samples kept on both sides of a pair, so that delay and readout can move in a solve. Beyond,
  // rates are held.
  double rate_margin_s = 0.004;
  // Rates are kept for frames that are late by as much, where frames have times of their own,
  // whatever their spread is [s].
  double late_margin_s = 0.0;
  // Noise of the gyro is estimated as its mean over so long, or less where what that neglects, a
  // random walk of the angle within the step, would turn the picture by more than so many pixels
  // (rms).
  double rate_step_s = 0.025;
  double rate_step_px = 0.05;
  // That many samples.
  int RateStep(double interval_s, double focal_px) const;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_OPTIONS_H_
