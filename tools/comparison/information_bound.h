// What two-view coplanarity can tell at best: the Cramer-Rao bound.
#ifndef CAMGYRO_TOOLS_COMPARISON_INFORMATION_BOUND_H_
#define CAMGYRO_TOOLS_COMPARISON_INFORMATION_BOUND_H_

#include <Eigen/Core>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"

namespace camgyro::comparison {

// What the measurements know about the calibration, with everything else that is unknown.
//
//   information = prior + sum over readings + sum over pairs, Fisher's, at the truth
//   match    e = tau . (R f x R' f'), standard deviation by first-order propagation of the pixel
//            noise through the whole measurement function; e vanishes at the truth, so de/sigma is
//            all there is to differentiate
//   reading  w_n + b_g, standard deviation gyro_sigma_rad_s; w_n free
//   tau      free in every pair. Without any parallax (pure rotation) it has no meaning: the mean
//            over three orthogonal ones is taken
//
// exact: matches without noise, one entry per pair of neighbouring frames; recording: stamps and
// gyro. truth: the calibration, prior_sigma the prior. noise_px > 0.
// Returns the lower bound of the covariance after each pair; pairs outside of the gyro's time add
// nothing. Neglects: the bias walk, and that neighbouring pairs share an observation.
std::vector<StateCovariance> InformationBound(const std::vector<FramePair>& exact,
                                              const Recording& recording, const Calibration& truth,
                                              const StateVector& prior_sigma, double noise_px,
                                              double gyro_sigma_rad_s);

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_INFORMATION_BOUND_H_
