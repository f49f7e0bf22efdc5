// Search for the lag between two streams of rates over a range, with its ambiguity.
#ifndef CAMGYRO_ESTIMATOR_START_LAG_SEARCH_H_
#define CAMGYRO_ESTIMATOR_START_LAG_SEARCH_H_

#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/start/rate_alignment.h"
#include "estimator/start/start_fit.h"

namespace camgyro {

struct LagPoint {
  double lag_s = 0.0;
  double explained = 0.0;
  double explained_mirrored = 0.0;
};

struct LagSearch {
  bool found = false;  // false: at no lag are there enough pairs inside the gyro's time
  std::vector<LagPoint> curve;
  bool on_edge = false;         // best at an end of the range: no minimum
  RateAlignment::Fit best;      // at fit.lag_s, with robust weights
  RateAlignment::Fit mirrored;  // at the lag of the best improper fit
  StartFit fit;
  double runner_up_ratio = 1.0;
  double runner_up_lag_s = 0.0;
};

// Evaluates the grid first..last, refines the best point by robust least squares, evaluates the
// grid again with the robust weights found there. Lags with fewer than min_pairs pairs are left
// out.
LagSearch SearchLag(const RateAlignment& alignment, double first_lag_s, double last_lag_s,
                    int min_pairs);

// Rates of camera rotations for a RateAlignment. Leaves out rotations faster than anything the gyro
// ever saw, twice over (unless these are half of them: then it is a unit, not outliers).
// Errors: frames out of range or not ascending, quaternions not finite.
Result<CameraRates> MakeCameraRates(const Recording& recording,
                                    const std::vector<CameraRotation>& rotations,
                                    const GyroRates& gyro);

// The `max_pairs` consecutive pairs with most rotation.
CameraRates LiveliestStretch(const CameraRates& camera, int max_pairs);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_LAG_SEARCH_H_
