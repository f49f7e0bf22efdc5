// The translation direction of one pair at a given calibration: the inner minimisation. It is
// searched, not iterated (docs/architecture.md, traps).
#ifndef CAMGYRO_ESTIMATOR_WINDOW_DIRECTION_SEARCH_H_
#define CAMGYRO_ESTIMATOR_WINDOW_DIRECTION_SEARCH_H_

#include <Eigen/Core>
#include <vector>

#include "factors/pair_bearings.h"

namespace camgyro {

struct DirectionEstimate {
  Eigen::Vector3d tau = Eigen::Vector3d::UnitZ();
  double cost = 0.0;              // sum of squared robust residuals [sigmas^2]
  std::vector<double> residuals;  // one per match, in sigmas, without loss
};

// Minimises the robust plane residuals over the unit sphere: cost on a fixed grid of directions
// and at the cross products of some pairs of matches, each point behind the camera counted as an
// outlier, then Gauss-Newton with the derivative of sigma from the best three, to the accuracy that
// a joint solve can start from. Deterministic. Of the matches first, first + step, ...
DirectionEstimate FindDirection(const PairBearings& bearings, double variance_a, double variance_b,
                                double robust_threshold, size_t first = 0, size_t step = 1);

// Cost of a direction beyond its residuals [sigmas^2]: matches that
// would lie behind the camera count as outliers, for the sign of tau that leaves fewer of them.
// Counted where the parallax is beyond 2 sigma.
double CostOfPointsBehind(const PairBearings& bearings, double variance_a, double variance_b,
                          double robust_threshold, const Eigen::Vector3d& tau);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_DIRECTION_SEARCH_H_
